// Where a timed run stood, to the bit: what is written now and then so that a run that was stopped goes on as
// if it had not been (docs/reference/motion.md).
//
// The file: eight bytes "flexelCP", the version, the sizes of the two parts that follow and the content hash
// of each [u64, little endian]; the values of Checkpoint one after another, numbers as they lie in memory,
// lists after their length; a body file, the body as the present act began.
#pragma once
#include <string>
#include <vector>

#include "simulate/time/series.h"
#include "simulate/time/time_segment.h"

namespace flexel::simulate {

struct Checkpoint {
  std::string scene_name, scene;  // for messages; the scene's text
  std::string output, history;    // -o and --history of the run; history "": none
  bool compress = false;          // --compress
  std::uint64_t input = 0;        // body_fingerprint() of the body that the run was given
  State state;
  Clock clock;
  TimeSegment::Memory memory;
  std::uint64_t events = 0;       // that have happened
  std::vector<Vec3> settled;      // of SegmentStart, as are
  std::vector<FusedPoint> fused;  // these
  std::vector<double> adaptive;   // of AdaptiveResolution; empty: lattices stay as they are
  EnergyBalance balance;
  double next_row = 0, next_frame = 0;  // s
  SeriesPlace frames;                   // of the series so far
};

// `body`: the bytes of its file. Appears under `path` only when it is whole. Throws InputError: it cannot be
// written.
void write_checkpoint(const Checkpoint& checkpoint, const Bytes& body, const std::string& path);

struct Resumed {
  Checkpoint checkpoint;
  Body body;
};
// Throws InputError: not a checkpoint, of another version, truncated or damaged.
[[nodiscard]] Resumed read_checkpoint(const std::string& path);

// Tells bodies apart by what a run reads of them: elements, cells and columns.
[[nodiscard]] std::uint64_t body_fingerprint(const Body& body);

}  // namespace flexel::simulate
