// A binding in a file: a part is bound once and mapped many times, by programs that run one after the other.
#pragma once
#include <string>

#include "mapping/methods/bind.h"

namespace flexel::mapping {

// Writes a binding of a method with a file_number (others keep too much to be worth a file). Throws
// InputError: another method, the disk.
void write_binding(const Binding& binding, const Body& body, const std::string& path);

// Reads it back for the same lattice and surface: what it gives is what bind() gives, to the bit. Throws
// InputError(path, ...): no binding, another version, damaged, made for another lattice or another surface.
[[nodiscard]] Binding read_binding(const std::string& path, const Body& body);

}  // namespace flexel::mapping
