// CAD files of the bracket of make_files.h, written by OpenCASCADE.
#pragma once
#include <string>

namespace flexel::test {

// `solid`: as one solid; else the trimmed surfaces alone, as most programs export IGES.
void write_bracket_iges(const std::string& path, bool solid, const char* unit = "MM");
void write_bracket_brep(const std::string& path, bool binary);
// A ball of 10 mm, of which a fine tessellation takes any amount of memory.
void write_ball_brep(const std::string& path);
// With every length of the file in metres.
void write_bracket_step(const std::string& path, const char* unit = "M");

}  // namespace flexel::test
