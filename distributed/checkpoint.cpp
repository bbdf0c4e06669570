// The hash is checked before anything is taken apart.
#include "distributed/checkpoint.h"

#include <fmt/format.h>

#include <cstring>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/output_file.h"
#include "base/files/packing.h"
#include "simulate/time/checkpoint.h"

namespace flexel::distributed {
namespace {

constexpr char kMagic[8] = {'f', 'l', 'e', 'x', 'e', 'l', 'L', 'S'};
constexpr std::uint64_t kVersion = 1;

struct Head {
  char magic[8];
  std::uint64_t version, hash;
};

struct Values {
  std::uint64_t scene = 0, body = 0;
  simulate::LoadStepDone done;
};

template <class Archive>
void visit_values(Archive& archive, Values& values) {
  visit_all(archive, values.scene, values.body, values.done.share, values.done.reach, values.done.residual,
            values.done.buckled, values.done.displacement);
}

}  // namespace

LoadStepFile::LoadStepFile(const simulate::Scene& scene, const Body& body)
    : scene_(content_hash(std::as_bytes(std::span(scene.text)))), body_(simulate::body_fingerprint(body)) {}

void LoadStepFile::write(const simulate::LoadStepDone& done, const std::string& path) const {
  Packer packer;
  Values values{scene_, body_, done};
  visit_values(packer, values);
  Head head{{}, kVersion, content_hash(packer.bytes)};
  std::memcpy(head.magic, kMagic, sizeof kMagic);
  OutputFile file(path);
  file.write(&head, sizeof head);
  file.write(packer.bytes.data(), packer.bytes.size());
  file.commit(true);
}

simulate::LoadStepDone LoadStepFile::read(const std::string& path) const {
  const Bytes bytes = read_all(path);
  Head head;
  if (bytes.size() < sizeof head || std::memcmp(bytes.data(), kMagic, sizeof kMagic) != 0)
    throw InputError(path, "is no checkpoint of load steps: give the file of an earlier --checkpoint");
  std::memcpy(&head, bytes.data(), sizeof head);
  if (head.version != kVersion)
    throw InputError(
        path, fmt::format("is a checkpoint of version {}, and this program reads version {}: begin anew "
                          "without --resume",
                          head.version, kVersion));
  const auto rest = std::span(bytes).subspan(sizeof head);
  constexpr const char* kDamage = "is truncated or damaged: begin anew without --resume";
  if (content_hash(rest) != head.hash) throw InputError(path, kDamage);
  Values values;
  Unpacker unpacker(rest, path, kDamage);
  visit_values(unpacker, values);
  unpacker.finish();
  if (values.scene != scene_ || values.body != body_)
    throw InputError(path,
                     fmt::format("is of a run of another {}: give that one, or begin anew without --resume",
                                 values.scene != scene_ ? "scene" : "body"));
  return values.done;
}

}  // namespace flexel::distributed
