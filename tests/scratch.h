// Where tests put their files.
#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

namespace flexel::test {

// A folder that nobody else has, also of tests that run at once; removed with its files.
class Scratch {
 public:
  Scratch() {
    static int number = 0;
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    std::string name = std::string("flexel-") + test->test_suite_name() + "-" + test->name();
    std::replace(name.begin(), name.end(), '/', '_');  // of tests with parameters
    folder_ = std::filesystem::temp_directory_path() /
              (name + "-" + std::to_string(getpid()) + "-" + std::to_string(++number));
    std::filesystem::create_directories(folder_);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  ~Scratch() { std::filesystem::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::string write(const std::string& name, const std::string& content) const {
    std::ofstream(path(name), std::ios::binary) << content;
    return path(name);
  }

 private:
  std::filesystem::path folder_;
};

}  // namespace flexel::test
