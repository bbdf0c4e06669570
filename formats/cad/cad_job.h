// What is asked of flexel-cad, the program that uses OpenCASCADE (cad/main.cpp), and what it answers. The library is
// loaded by that program alone: where no CAD file comes nobody waits for it, and what a damaged file does to it
// harms nobody else.
#pragma once
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/common/child_job.h"
#include "formats/part/surface.h"

namespace flexel {

// What OpenCASCADE's readers of STEP and IGES make of every unit [m].
inline constexpr double kMillimetre = 1e-3;

// Read a CAD file.
struct CadReadJob {
  std::string format;  // name of its FileFormat
  Bytes bytes;
  std::string where, file;           // as those of ImportInput
  double unit = kMillimetre;         // metres per unit of a format that carries none
  std::optional<double> deflection;  // as those of ImportOptions
  double angular_deflection = 0;
  std::uint64_t threads = 1;
};

// The tessellation of a CAD file's solids: triangles in metres, one solid after the other, as OpenCASCADE
// gives them. No columns, no sources.
struct CadMesh {
  Surface surface;
  std::vector<double> face_colors;  // (faces x 3) red, green, blue in [0, 1]; empty: the file has none
};

// Write the CAD files of a body, deformed as it is.
struct CadWriteJob {
  Bytes body;  // a body file; its sources hold the CAD files
  std::vector<std::string>
      formats;  // to write, each once. BREP, which has no unit: in that of the source where it comes alone, else in mm
  std::string method;    // of the mapping
  double scale = 1;      // of the displacements
  double tolerance = 0;  // m, that surfaces may miss the deformation by
  // of the mapped triangles, beside that at rest; nan: not known
  double volume = std::numeric_limits<double>::quiet_NaN();
  std::uint64_t threads = 1;
};

// A face that is farther from the deformation than the tolerance.
struct CadFace {
  std::string name;      // "bracket/12"
  double deviation = 0;  // m
};

// One of the files that a job asks for.
struct CadFile {
  Bytes bytes;
  std::uint64_t invalid_again =
      0;  // solids that OpenCASCADE's check finds invalid when the file is read again
};

struct CadWritten {
  std::vector<CadFile> files;  // in the order of the job's formats
  std::uint64_t solids = 0, faces = 0;
  std::uint64_t kept = 0;           // faces that are planes, cylinders ... as before
  double tolerance = 0;             // m
  double deviation = 0;             // m, largest distance from the deformation, at points of the faces
  std::string deviation_face;       // where that is
  std::vector<CadFace> missed;      // faces that miss it by more than the tolerance
  std::vector<std::string> folded;  // faces on which the deformation turns space inside out
  // Solids that OpenCASCADE's check finds invalid, and those of them that were so in the source
  std::vector<std::string> invalid, invalid_before;
  double gap = 0;                        // m, largest distance of an edge from the faces that meet in it
  double volume = 0, volume_before = 0;  // m^3, of all solids together
};

[[nodiscard]] Bytes pack(const CadReadJob& job);
[[nodiscard]] Bytes pack(const CadWriteJob& job);
[[nodiscard]] Bytes pack(const JobAnswer<CadMesh>& answer);
[[nodiscard]] Bytes pack(const JobAnswer<CadWritten>& answer);

// What a job asks for: one of the two. Throws InputError: these bytes are not from pack().
struct CadJob {
  std::optional<CadReadJob> read;
  std::optional<CadWriteJob> write;
};
[[nodiscard]] CadJob unpack_job(std::span<const std::byte> bytes);

// Throw InputError(where, ...): the same, of an answer.
[[nodiscard]] JobAnswer<CadMesh> unpack_mesh(std::span<const std::byte> bytes, const std::string& where);
[[nodiscard]] JobAnswer<CadWritten> unpack_written(std::span<const std::byte> bytes,
                                                   const std::string& where);

// Has flexel-cad do it. Throws InputError(where, ...): it crashes, takes more than the limits, or answers what does not
// fit together; its own refusal. `instead`: what to do where the limits are passed. Calls `warn` with its warnings.
[[nodiscard]] CadMesh run_job(const CadReadJob& job, const ChildLimits& limits, const std::string& instead,
                              const std::function<void(const std::string&)>& warn);
[[nodiscard]] CadWritten run_job(const CadWriteJob& job, const ChildLimits& limits, const std::string& where,
                                 const std::function<void(const std::string&)>& warn);

}  // namespace flexel
