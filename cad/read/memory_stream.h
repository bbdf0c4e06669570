// A stream over bytes in memory.
#pragma once
#include <istream>
#include <streambuf>

#include "base/files/files.h"

namespace flexel::cad {

class MemoryStream : private std::streambuf, public std::istream {
 public:
  explicit MemoryStream(const Bytes& bytes) : std::istream(static_cast<std::streambuf*>(this)) {
    char* begin = const_cast<char*>(reinterpret_cast<const char*>(bytes.data()));  // nothing writes to it
    setg(begin, begin, begin + bytes.size());
  }
};

}  // namespace flexel::cad
