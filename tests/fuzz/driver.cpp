// Mutant n is made from the corpus by a generator seeded with n, so any failure is repeated with `--first n
// --iterations 1`. Each takes one input and does 1 to 4 of: flip a bit, set a byte to a telling value,
// replace a number by an awkward one, delete, repeat or copy over a piece, cut the end off. An 8-byte
// little-endian overwrite reaches the sizes in binary headers.
#include "tests/fuzz/driver.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <random>

#include "base/program/address_sanitizer.h"
#include "tests/fuzz/trial.h"

namespace flexel::fuzz {
namespace {

constexpr unsigned kSecondsPerInput = 20;
constexpr rlim_t kAddressSpace =
    rlim_t{6} << 30;  // a reader that believes a wrong size fails here rather than swapping

using Random = std::mt19937_64;

std::size_t below(Random& random, std::size_t n) {
  return n == 0 ? 0 : static_cast<std::size_t>(random() % n);
}

// Replaces the first decimal number at or after `from` by one that readers get wrong.
void awkward_number(Bytes& data, Random& random, std::size_t from) {
  static const std::vector<std::string> awkward = {"nan",
                                                   "-inf",
                                                   "1e999",
                                                   "-1",
                                                   "0",
                                                   "4294967296",
                                                   "-9223372036854775809",
                                                   "1e-320",
                                                   "0x7",
                                                   "",
                                                   "1,5",
                                                   "99999999999999999999"};
  const auto digit = [&](std::size_t i) {
    return std::isdigit(std::to_integer<unsigned char>(data[i])) != 0;
  };
  std::size_t begin = from;
  while (begin < data.size() && !digit(begin)) ++begin;
  std::size_t end = begin;
  while (end < data.size() && (digit(end) || data[end] == std::byte{'.'})) ++end;
  const Bytes text = bytes_of(awkward[below(random, awkward.size())]);
  data.erase(data.begin() + static_cast<std::ptrdiff_t>(begin),
             data.begin() + static_cast<std::ptrdiff_t>(end));
  data.insert(data.begin() + static_cast<std::ptrdiff_t>(begin), text.begin(), text.end());
}

void overwrite_integer(Bytes& data, Random& random, std::size_t at) {
  static constexpr std::uint64_t values[] = {
      0, 1, 0x7fffffff, 0xffffffff, 0x7fffffffffffffff, 0xffffffffffffffff, 1ull << 40};
  const std::uint64_t value = values[below(random, std::size(values))];
  const std::size_t width = below(random, 2) == 0 ? 4 : 8;
  if (at + width <= data.size()) std::memcpy(data.data() + at, &value, width);
}

void mutate_once(Bytes& data, Random& random) {
  if (data.empty()) return;
  const std::size_t at = below(random, data.size());
  const std::size_t length =
      std::min(data.size() - at, 1 + below(random, std::size_t{1} << below(random, 12)));
  const auto begin = data.begin() + static_cast<std::ptrdiff_t>(at);
  const auto end = begin + static_cast<std::ptrdiff_t>(length);
  switch (below(random, 8)) {
    case 0:
      data[at] ^= std::byte{1} << below(random, 8);
      break;
    case 1:
      data[at] = static_cast<std::byte>("\0\xff\n <>\"=[]{}/-."[below(random, 16)]);
      break;
    case 2:
      awkward_number(data, random, at);
      break;
    case 3:
      overwrite_integer(data, random, at);
      break;
    case 4:
      data.erase(begin, end);
      break;
    case 5: {
      const Bytes piece(begin, end);
      data.insert(data.begin() + static_cast<std::ptrdiff_t>(below(random, data.size() + 1)), piece.begin(),
                  piece.end());
      break;
    }
    case 6: {
      const Bytes piece(begin, end);
      const std::size_t to = below(random, data.size() - piece.size() + 1);
      std::copy(piece.begin(), piece.end(), data.begin() + static_cast<std::ptrdiff_t>(to));
      break;
    }
    default:
      data.resize(at);
      break;
  }
}

Bytes mutant(const std::vector<Bytes>& corpus, std::size_t number) {
  Random random(number);
  Bytes data = corpus[below(random, corpus.size())];
  for (std::size_t left = 1 + below(random, 4); left > 0; --left) mutate_once(data, random);
  return data;
}

struct Arguments {
  std::size_t iterations = 500, first = 0;
  double seconds = 1e9;
};

Arguments parse(int argc, char** argv) {
  Arguments arguments;
  bool iterations_given = false;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string option = argv[i];
    if (option == "--iterations") arguments.iterations = std::stoul(argv[i + 1]), iterations_given = true;
    if (option == "--first") arguments.first = std::stoul(argv[i + 1]);
    if (option == "--seconds") arguments.seconds = std::stod(argv[i + 1]);
  }
  if (arguments.seconds < 1e9 && !iterations_given) arguments.iterations = SIZE_MAX - arguments.first;
  return arguments;
}

void limit_address_space() {
#ifndef FLEXEL_ADDRESS_SANITIZER  // which needs terabytes of it
  const rlimit limit{kAddressSpace, kAddressSpace};
  setrlimit(RLIMIT_AS, &limit);
#endif
}

}  // namespace

int run(int argc, char** argv, const std::string& name, const std::vector<Bytes>& corpus,
        const std::function<void(const std::string& path)>& read) {
  const Arguments arguments = parse(argc, argv);
  limit_address_space();
  const Trial trial(name, read);
  const std::vector<Bytes> seeds = trial.seeds(corpus);
  const auto began = std::chrono::steady_clock::now();
  const auto seconds = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  };
  std::size_t done = 0, taken = 0;
  for (; done < arguments.iterations && seconds() < arguments.seconds; ++done) {
    alarm(kSecondsPerInput);
    const Trial::Outcome outcome = trial(mutant(seeds, arguments.first + done));
    if (outcome == Trial::Outcome::failed) {
      std::fprintf(stderr, "%s: mutant %zu failed; it is in %s\n", name.c_str(), arguments.first + done,
                   trial.path().c_str());
      return 1;
    }
    taken += outcome == Trial::Outcome::accepted ? 1 : 0;
  }
  alarm(0);
  trial.clean();
  std::printf("%s: %zu mutants, %zu accepted, %zu refused\n", name.c_str(), done, taken, done - taken);
  return 0;
}

}  // namespace flexel::fuzz
