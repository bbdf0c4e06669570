// One list of the values serves writing and reading. Everything is checked by its hash before it is taken
// apart; lengths are checked all the same.
#include "simulate/time/checkpoint.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/output_file.h"
#include "base/files/packing.h"
#include "formats/lattice/body_file.h"

namespace flexel {

// Where argument-dependent lookup finds it.
template <class Archive>
static void visit(Archive& archive, FusedPoint& point) {
  visit_all(archive, point.elements, point.weights, point.stiffness, point.length);
}

}  // namespace flexel

namespace flexel::simulate {
namespace {

constexpr char kMagic[8] = {'f', 'l', 'e', 'x', 'e', 'l', 'C', 'P'};
constexpr std::uint64_t kVersion = 10;

struct Head {
  char magic[8];
  std::uint64_t version, values_size, body_size, values_hash, body_hash;
};

std::span<const std::byte> bytes_of(const void* data, std::size_t size) {
  return {static_cast<const std::byte*>(data), size};
}

}  // namespace

// Outside the unnamed namespace, where argument-dependent lookup finds them.
template <class Archive>
static void visit(Archive& archive, Account& account) {
  visit_all(archive, account.name, account.kind, account.energy);
}

template <class Archive>
static void visit(Archive& archive, BookRow& row) {
  visit_all(archive, row.time, row.energies, row.accounts, row.momentum, row.angular, row.probes, row.values);
}

template <class Archive>
static void visit(Archive& archive, Checkpoint& c) {
  for (std::string* text : {&c.scene_name, &c.scene, &c.output, &c.history}) visit(archive, *text);
  visit_all(archive, c.compress, c.input, c.state.displacement, c.state.velocity, c.state.share, c.state.time,
            c.state.kick, c.clock, c.memory.cells.fill, c.memory.cells.plastic, c.memory.cells.springs,
            c.memory.cells.spring_flow, c.memory.connections.flowed, c.memory.connections.strain,
            c.memory.connections.broken, c.memory.reach, c.memory.supports, c.events, c.settled, c.fused,
            c.memory.effects, c.adaptive, c.balance.accounts, c.balance.rows, c.balance.probes,
            c.balance.columns, c.balance.start, c.balance.changed, c.balance.worst_residual,
            c.balance.unstored, c.balance.unstored_now, c.balance.worst_unstored, c.balance.largest_term,
            c.next_row, c.next_frame, c.frames.times, c.frames.surface_frame, c.frames.surface_parts);
}

void write_checkpoint(const Checkpoint& checkpoint, const Bytes& body, const std::string& path) {
  Packer packer;
  visit(packer, const_cast<Checkpoint&>(checkpoint));
  Head head{{}, kVersion, packer.bytes.size(), body.size(), content_hash(packer.bytes), content_hash(body)};
  std::memcpy(head.magic, kMagic, sizeof kMagic);
  OutputFile file(path);
  file.write(&head, sizeof head);
  file.write(packer.bytes.data(), packer.bytes.size());
  file.write(body.data(), body.size());
  file.commit();
}

Resumed read_checkpoint(const std::string& path) {
  const std::string where = path == "-" ? "stdin" : path;
  const Bytes bytes = read_all(path);
  Head head;
  if (bytes.size() < sizeof kMagic || std::memcmp(bytes.data(), kMagic, sizeof kMagic) != 0)
    throw InputError(where, "is not a checkpoint: one written by flexel-simulate --checkpoint is needed");
  if (bytes.size() >= sizeof head) std::memcpy(&head, bytes.data(), sizeof head);
  if (bytes.size() >= 16 && (std::memcpy(&head.version, bytes.data() + 8, 8), head.version != kVersion))
    throw InputError(where, fmt::format("is a checkpoint of version {}; this program reads version {}: "
                                        "resume with the release that wrote it",
                                        head.version, kVersion));
  const std::size_t size = bytes.size() < sizeof head ? 0 : bytes.size() - sizeof head;
  if (bytes.size() < sizeof head || head.values_size > size || head.body_size != size - head.values_size)
    throw InputError(where, "is truncated: copy it again, or resume from another checkpoint");
  const auto values = std::span(bytes).subspan(sizeof head, head.values_size);
  const auto body = std::span(bytes).subspan(sizeof head + head.values_size);
  if (content_hash(values) != head.values_hash || content_hash(body) != head.body_hash)
    throw InputError(where, "is damaged: copy it again, or resume from another checkpoint");
  Resumed resumed;
  Unpacker unpacker(values, where, "damaged: its values do not fit together");
  visit(unpacker, resumed.checkpoint);
  unpacker.finish();
  resumed.body = read_body(Bytes(body.begin(), body.end()), where);
  const Checkpoint& c = resumed.checkpoint;
  const std::size_t n = resumed.body.element_count();
  const auto fits = [&](const FusedPoint& point) {
    return point.weights.size() == point.elements.size() &&
           std::all_of(point.elements.begin(), point.elements.end(), [&](std::uint32_t e) { return e < n; });
  };
  if (c.state.displacement.size() != n || c.state.velocity.size() != n || !c.state.time ||
      (!c.settled.empty() && c.settled.size() != n) || !std::all_of(c.fused.begin(), c.fused.end(), fits))
    throw InputError(where, "is damaged: its state is not that of its body");
  return resumed;
}

std::uint64_t body_fingerprint(const Body& body) {
  std::vector<std::uint64_t> hashes;
  const auto add = [&](const auto& values) {
    hashes.push_back(content_hash(bytes_of(values.data(), values.size() * sizeof(values[0]))));
  };
  add(body.lattice_index);
  add(body.rest);
  add(body.position);
  add(body.cell_elements);
  add(body.fill);
  add(body.broken);
  add(body.connections);
  add(body.surface.vertices);
  add(body.surface.polygon_vertices);
  for (const Columns* columns : {&body.element_columns, &body.cell_columns})
    for (const auto& [name, column] : *columns) {
      add(name);
      add(column.values);
    }
  for (const Part& part : body.parts) {
    add(part.name);
    add(part.material);
  }
  return content_hash(bytes_of(hashes.data(), hashes.size() * sizeof hashes[0]));
}

}  // namespace flexel::simulate
