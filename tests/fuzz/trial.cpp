// The readers take names of files, so every input becomes one.
#include "tests/fuzz/trial.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "base/error.h"
#include "base/printable.h"
#include "base/text.h"
#include "tests/fuzz/driver.h"

namespace flexel::fuzz {
namespace fs = std::filesystem;

Bytes bytes_of(const std::string& text) {
  Bytes bytes(text.size());
  std::transform(text.begin(), text.end(), bytes.begin(), [](char c) { return static_cast<std::byte>(c); });
  return bytes;
}

Trial::Trial(std::string name, std::function<void(const std::string& path)> read)
    : name_(std::move(name)), read_(std::move(read)) {
  const fs::path memory = "/dev/shm";
  std::error_code none;
  const fs::path folder = fs::is_directory(memory, none) ? memory : fs::temp_directory_path();
  path_ = folder / (name_ + "-" + std::to_string(getpid()));
}

Trial::Outcome Trial::operator()(std::span<const std::byte> data) const {
  std::ofstream(path_, std::ios::binary)
      .write(reinterpret_cast<const char*>(data.data()), static_cast<std::streamsize>(data.size()));
  try {
    read_(path_);
    return Outcome::accepted;
  } catch (const InputError& error) {
    reason_ = printable(one_line(error.what()));  // as run_program() says it
    if (!reason_.empty()) return Outcome::refused;
    std::fprintf(stderr, "%s: a refusal without a reason\n", name_.c_str());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: an exception that is no InputError: %s\n", name_.c_str(), error.what());
  }
  return Outcome::failed;
}

std::vector<Bytes> Trial::seeds(const std::vector<Bytes>& corpus) const {
  const auto end_with = [&](const std::string& what) {
    std::fprintf(stderr, "%s: %s\n", name_.c_str(), what.c_str());
    std::exit(1);
  };
  std::vector<Bytes> all = corpus;
  for (const Bytes& good : corpus)
    if ((*this)(good) != Outcome::accepted)
      end_with("an unchanged input of the corpus is refused; it is in " + path_ + ": " + reason_);
  const fs::path folder = fs::path(FLEXEL_FUZZ_CORPUS) / name_;
  if (!fs::is_directory(folder)) return all;
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) {
    all.push_back(read_all(file));
    if ((*this)(all.back()) == Outcome::failed) end_with(file.string() + " failed");
  }
  return all;
}

void Trial::clean() const {
  fs::remove(path_);
}

}  // namespace flexel::fuzz
