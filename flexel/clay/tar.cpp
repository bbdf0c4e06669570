// A header of 512 bytes with numbers in octal digits, then the file, filled up to whole blocks; two empty blocks end it.
#include "flexel/clay/tar.h"

#include <fmt/format.h>

namespace flexel::clay {
namespace {

constexpr std::size_t kBlock = 512, kSumAt = 148, kSumSize = 8;

std::string header_of(const std::string& name, std::size_t size) {
  std::string header = name.substr(0, 99);
  const auto field = [&](std::size_t at, const std::string& text) {
    header.resize(at, '\0');
    header += text;
  };
  field(100, "0000644");
  field(108, "0000000");
  field(116, "0000000");
  field(124, fmt::format("{:011o}", size));
  field(136, "00000000000");
  field(kSumAt, "        ");  // blanks, for the sum
  header += '0';
  field(257, std::string("ustar\0"
                         "00",
                         8));
  header.resize(kBlock, '\0');
  unsigned sum = 0;
  for (const char c : header) sum += static_cast<unsigned char>(c);
  const std::string digits = fmt::format("{:06o}", sum) + std::string("\0 ", 2);
  return header.replace(kSumAt, kSumSize, digits);
}

}  // namespace

std::string tar_of(const std::vector<std::pair<std::string, std::string>>& files) {
  std::string tar;
  for (const auto& [name, bytes] : files) {
    tar += header_of(name, bytes.size());
    tar += bytes;
    tar.resize((tar.size() + kBlock - 1) / kBlock * kBlock, '\0');
  }
  return tar.append(2 * kBlock, '\0');
}

}  // namespace flexel::clay
