// The same fuzzers led by coverage: libFuzzer mutates, and keeps what reaches new code. Its own arguments are taken
// (-max_total_time=60, -dict=FILE, folders of inputs); the corpus goes in as a further folder.
#include <sys/types.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "base/parallel.h"
#include "tests/fuzz/driver.h"
#include "tests/fuzz/trial.h"

extern "C" int LLVMFuzzerRunDriver(int* argc, char*** argv,
                                   int (*callback)(const std::uint8_t*, std::size_t));

namespace flexel::fuzz {
namespace {

const Trial* trial = nullptr;

int try_one(const std::uint8_t* data, std::size_t size) {
  if ((*trial)(std::as_bytes(std::span(data, size))) == Trial::Outcome::failed) std::abort();
  return 0;
}

}  // namespace

int run(int argc, char** argv, const std::string& name, const std::vector<Bytes>& corpus,
        const std::function<void(const std::string& path)>& read) {
  const ThreadLimit one(1);  // the order of threads would look like new code
  const Trial reader(name, read);
  trial = &reader;
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / (name + "-seeds-" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  std::size_t number = 0;
  for (const Bytes& seed : reader.seeds(corpus))
    std::ofstream(folder / std::to_string(number++), std::ios::binary)
        .write(reinterpret_cast<const char*>(seed.data()), static_cast<std::streamsize>(seed.size()));
  std::vector<std::string> words(argv, argv + argc);
  words.push_back(folder.string());
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  int count = static_cast<int>(pointers.size());
  pointers.push_back(nullptr);
  char** arguments = pointers.data();
  const int status = LLVMFuzzerRunDriver(&count, &arguments, try_one);
  std::filesystem::remove_all(folder);
  reader.clean();
  return status;
}

}  // namespace flexel::fuzz
