// Nothing of assimp's post-processing: it joins vertices by single-precision neighbourhoods, and drops what it holds for
// degenerate. Its own choice of axes is undone, so that a part comes out in those of its file.
#include "meshes/assimp_reader.h"

#include <assimp/MemoryIOWrapper.h>
#include <assimp/config.h>
#include <assimp/material.h>
#include <assimp/metadata.h>
#include <assimp/scene.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <assimp/DefaultLogger.hpp>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <assimp/LogStream.hpp>
#include <assimp/Logger.hpp>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "base/math/weld.h"
#include "meshes/amf_document.h"
#include "meshes/dxf_entities.h"
#include "meshes/written_unit.h"
#include "meshes/x3d_document.h"

namespace flexel::meshes {
namespace {

constexpr std::size_t kMostUses = 1'000'000;  // of meshes

// The file's bytes under the only name that there is: a file may come from anybody, so no other is opened.
class OneFile : public Assimp::IOSystem {
 public:
  OneFile(std::string name, const Bytes& bytes) : name_(std::move(name)), bytes_(bytes) {}
  bool Exists(const char* path) const override { return name_ == path; }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* path, const char*) override {
    if (!Exists(path)) return nullptr;
    return new Assimp::MemoryIOStream(reinterpret_cast<const std::uint8_t*>(bytes_.data()), bytes_.size());
  }
  void Close(Assimp::IOStream* stream) override { delete stream; }

 private:
  std::string name_;
  const Bytes& bytes_;
};

Eigen::Matrix4d matrix_of(const aiMatrix4x4& m) {
  Eigen::Matrix4d matrix;
  matrix << m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2, m.c3, m.c4, m.d1, m.d2, m.d3, m.d4;
  return matrix;
}

// Undoes what assimp does to the whole scene: (x, y, z) was made (x, z, -y), Collada's unit a (single-precision) factor.
Eigen::Matrix4d own_axes(const std::string& format, double unit) {
  Eigen::Matrix4d back = Eigen::Matrix4d::Identity();
  if (format == "3ds" || format == "ase" || format == "dxf") back.block<2, 2>(1, 1) << 0, -1, 1, 0;
  if (format == "dae") back.topLeftCorner<3, 3>() /= static_cast<float>(unit);
  return back;
}

// By which assimp tells formats apart.
std::string file_name(const std::string& format) {
  return "part." + format;
}

// FBX: centimetres a unit.
double fbx_unit(const aiScene& scene) {
  float centimetres = 0;
  double wide = 0;
  if (scene.mMetaData == nullptr) return 1e-2;
  if (!scene.mMetaData->Get("UnitScaleFactor", centimetres) && scene.mMetaData->Get("UnitScaleFactor", wide))
    centimetres = static_cast<float>(wide);
  if (!std::isfinite(centimetres) || centimetres <= 0) return 1e-2;
  // 2.54f is meant as 2.54
  return 1e-2 * std::stod(fmt::format("{}", centimetres));
}

class AssimpReader {
 public:
  AssimpReader(const aiScene& scene, const MeshReadJob& job, double unit) : scene_(scene), job_(job) {
    mesh_.unit = unit;
    mesh_.polygon_offsets.push_back(0);
  }

  // What the scene shows, in the order of its nodes.
  void show_scene() {
    std::vector<Shown> pending = {{scene_.mRootNode, own_axes(job_.format, mesh_.unit), ""}};
    while (!pending.empty()) {
      const auto [node, above, name_above] = pending.back();
      pending.pop_back();
      const Eigen::Matrix4d transform = above * matrix_of(node->mTransformation);
      const std::string name = name_of(*node, name_above);
      if (node->mNumMeshes > 0) add_part(*node, transform, name);
      for (unsigned i = node->mNumChildren; i > 0; --i)
        pending.push_back({node->mChildren[i - 1], transform, name});
    }
  }

  // What an AMF file shows; assimp calls an object's node by its id.
  void show(const AmfDocument& amf) {
    for (const AmfDocument::Use& use : amf.uses) {
      const aiNode* node = scene_.mRootNode->FindNode(use.object.c_str());
      if (node == nullptr) continue;  // an object without triangles
      const auto name = amf.names.find(use.object);
      add_part(*node, use.transform, name == amf.names.end() ? "" : name->second);
    }
  }

  ForeignMesh mesh() {
    if (mesh_.polygon_vertices.empty()) throw InputError(job_.where, "shows no polygons: nothing to work on");
    if (colored_) mesh_.polygon_colors = std::move(colors_);
    return std::move(mesh_);
  }

  // How many meshes of polygons were shown.
  [[nodiscard]] std::size_t shown() const { return shown_; }

  // What is left out of the file, for one line; empty: nothing.
  [[nodiscard]] std::vector<std::string> left_out(std::size_t lines_before) const {
    const std::size_t lines = lines_ + lines_before;
    std::vector<std::string> all;
    if (textures_) all.emplace_back("textures");
    if (colors_within_) all.emplace_back("changes of colour within a polygon");
    if (bones_) all.emplace_back("skeletons");
    if (morphs_) all.emplace_back("morph targets");
    if (scene_.mNumAnimations > 0) all.emplace_back("animations");
    if (lines > 0) all.push_back(fmt::format("{} points and lines", lines));
    return all;
  }

 private:
  // A node, and the transform and name of those above it.
  struct Shown {
    const aiNode* node;
    Eigen::Matrix4d above;
    std::string name;
  };

  void add_part(const aiNode& node, const Eigen::Matrix4d& transform, const std::string& name) {
    if (++uses_ > kMostUses) throw InputError(job_.where, "shows more than a million meshes: it is damaged");
    const std::size_t polygons = mesh_.polygon_part.size();
    corners_.clear();
    for (unsigned i = 0; i < node.mNumMeshes; ++i)
      if (node.mMeshes[i] < scene_.mNumMeshes) add_mesh(*scene_.mMeshes[node.mMeshes[i]], transform);
    if (mesh_.polygon_part.size() == polygons) return;
    weld_corners();
    mesh_.part_names.push_back(name);
  }

  // The node's, its mesh's, or that of the nearest node above with one; none that assimp makes up ("<DXF_ROOT>").
  [[nodiscard]] std::string name_of(const aiNode& node, const std::string& above) const {
    std::string own = node.mName.C_Str();
    if (own.starts_with('<') || own == file_name(job_.format)) own.clear();
    if (own.empty() && node.mNumMeshes > 0 && node.mMeshes[0] < scene_.mNumMeshes)
      own = scene_.mMeshes[node.mMeshes[0]]->mName.C_Str();
    return own.empty() ? above : own;
  }

  void add_mesh(const aiMesh& mesh, const Eigen::Matrix4d& transform) {
    const bool mirrored = transform.topLeftCorner<3, 3>().determinant() < 0;
    const auto group = static_cast<std::uint32_t>(mesh_.group_names.size());
    const aiMaterial* material =
        mesh.mMaterialIndex < scene_.mNumMaterials ? scene_.mMaterials[mesh.mMaterialIndex] : nullptr;
    textures_ = textures_ || mesh.HasTextureCoords(0);
    bones_ = bones_ || mesh.HasBones();
    morphs_ = morphs_ || mesh.mNumAnimMeshes > 0;
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices < 3) {
        ++lines_;
        continue;
      }
      for (unsigned c = 0; c < face.mNumIndices; ++c)
        add_corner(mesh, face.mIndices[mirrored ? face.mNumIndices - 1 - c : c], transform);
      mesh_.polygon_offsets.push_back(checked(mesh_.polygon_vertices.size() + corners_.size()));
      mesh_.polygon_part.push_back(static_cast<std::uint32_t>(mesh_.part_names.size()));
      mesh_.polygon_group.push_back(group);
      add_color(mesh, face, material);
    }
    shown_ += mesh_.polygon_group.empty() || mesh_.polygon_group.back() != group ? 0 : 1;
    mesh_.group_names.emplace_back(material == nullptr ? "" : material->GetName().C_Str());
  }

  [[nodiscard]] std::uint32_t checked(std::size_t count) const {
    if (count > 0xffffffffu) throw InputError(job_.where, "holds too many polygons");
    return static_cast<std::uint32_t>(count);
  }

  void add_corner(const aiMesh& mesh, unsigned vertex, const Eigen::Matrix4d& transform) {
    if (vertex >= mesh.mNumVertices)
      throw InputError(job_.where,
                       fmt::format("is damaged: a polygon names vertex {} (from 0), but there are only {}",
                                   vertex, mesh.mNumVertices));
    const aiVector3D& at = mesh.mVertices[vertex];
    const Vec3 world =
        transform.topLeftCorner<3, 3>() * Vec3(at.x, at.y, at.z) + transform.topRightCorner<3, 1>();
    if (!world.allFinite())
      throw InputError(
          job_.where,
          fmt::format("vertex {} of a mesh has a coordinate that is not a finite number", vertex + 1));
    corners_.push_back(world);
  }

  // That of the corners, their mean, or the material's.
  void add_color(const aiMesh& mesh, const aiFace& face, const aiMaterial* material) {
    aiColor4D color(1, 1, 1, 1);
    if (mesh.HasVertexColors(0) && !is_blank(mesh)) {
      const aiColor4D first = mesh.mColors[0][face.mIndices[0]];
      color = aiColor4D(0, 0, 0, 0);
      for (unsigned c = 0; c < face.mNumIndices; ++c) {
        color += mesh.mColors[0][face.mIndices[c]];
        colors_within_ = colors_within_ || mesh.mColors[0][face.mIndices[c]] != first;
      }
      color = color * (1 / static_cast<float>(face.mNumIndices));
      colored_ = true;
    } else if (material != nullptr && material->GetName() != aiString(AI_DEFAULT_MATERIAL_NAME) &&
               material->Get(AI_MATKEY_COLOR_DIFFUSE, color) == aiReturn_SUCCESS) {
      colored_ = true;
    }
    for (const float value : {color.r, color.g, color.b, color.a})
      colors_.push_back(std::isfinite(value) ? std::clamp(static_cast<double>(value), 0.0, 1.0) : 1);
  }

  // assimp makes colours for formats whose file has none: all zero, the opacity too.
  [[nodiscard]] static bool is_blank(const aiMesh& mesh) {
    return std::all_of(mesh.mColors[0], mesh.mColors[0] + mesh.mNumVertices,
                       [](const aiColor4D& color) { return color == aiColor4D(0, 0, 0, 0); });
  }

  // Corners at equal positions become one vertex, in the order of first use: most formats have a vertex for each corner.
  void weld_corners() {
    const std::vector<std::uint32_t> first = first_equal(corners_.size(), [&](std::size_t i) {
      return position_key(corners_[i].x(), corners_[i].y(), corners_[i].z());
    });
    std::vector<std::uint32_t> number(corners_.size());
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      if (first[i] == i) {
        number[i] = checked(mesh_.vertices.size());
        mesh_.vertices.push_back(corners_[i]);
      }
      mesh_.polygon_vertices.push_back(number[first[i]]);
    }
  }

  const aiScene& scene_;
  const MeshReadJob& job_;
  ForeignMesh mesh_;
  std::vector<Vec3> corners_;  // of the part that is added
  std::vector<double> colors_;
  std::size_t uses_ = 0, shown_ = 0, lines_ = 0;
  bool colored_ = false, colors_within_ = false, textures_ = false, bones_ = false, morphs_ = false;
};

// What assimp says while it reads that may mean a shape is missing; nothing else of its log.
class Doubts : public Assimp::LogStream {
 public:
  Doubts() {
    Assimp::DefaultLogger::create("", Assimp::Logger::NORMAL, 0);
    Assimp::DefaultLogger::get()->attachStream(this, Assimp::Logger::Warn | Assimp::Logger::Err);
  }
  ~Doubts() override {
    Assimp::DefaultLogger::get()->detachStream(this);
    Assimp::DefaultLogger::kill();
  }
  Doubts(const Doubts&) = delete;
  Doubts& operator=(const Doubts&) = delete;

  void write(const char* line) override {
    std::string_view text = line;  // "Warn,  T0: ..."
    if (const std::size_t at = text.find(": "); at != std::string_view::npos) text.remove_prefix(at + 2);
    const auto speaks_of = [&](auto... words) {
      return (... || (text.find(words) != std::string_view::npos));
    };
    const bool of_shapes = speaks_of("skip", "ignor", "unsupported", "not supported", "not implemented",
                                     "invalid", "unexpected");
    const bool of_looks =
        speaks_of("BlendDNA", "texture", "material", "anim", "track", "light", "camera", "Lamp", "UV", "uv",
                  "normal", "tangent", "color", "chunk", "shader", "version");
    if (of_shapes && !of_looks && count_++ == 0) first_ = clean_name(text.substr(0, 160));
  }
  // "" where nothing was said.
  [[nodiscard]] std::string told() const {
    if (count_ == 0) return "";
    return fmt::format("assimp says: {}{}; see that no shape is missing", first_,
                       count_ > 1 ? fmt::format(" (one of {} such lines)", count_) : "");
  }

 private:
  std::string first_;
  std::size_t count_ = 0;
};

// assimp's reason, in one line.
std::string reason(std::string text) {
  text = clean_name(text.substr(0, 200));
  return text.empty() ? "no reason" : text;
}

}  // namespace

ForeignMesh read_with_assimp(const MeshReadJob& job, const Warn& warn) {
  const bool x3d = job.format == "x3d", amf = job.format == "amf";
  const X3dDocument x3d_file = x3d ? x3d_document(job.bytes, job.where) : X3dDocument();
  const AmfDocument amf_file = amf ? amf_document(job.bytes, job.where) : AmfDocument();
  const std::string_view text(reinterpret_cast<const char*>(job.bytes.data()), job.bytes.size());
  const std::size_t dxf_lines = job.format == "dxf" ? check_dxf_entities(text, job.where) : 0;
  Doubts doubts;  // lives longer than the importer, which speaks at its end
  Assimp::Importer importer;
  const std::string name = file_name(job.format);
  importer.SetIOHandler(new OneFile(name, x3d ? x3d_file.bytes : amf ? amf_file.bytes : job.bytes));
  importer.SetPropertyInteger(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, 1);
  const aiScene* scene = importer.ReadFile(name, 0);
  if (scene == nullptr || scene->mRootNode == nullptr)
    throw InputError(
        job.where,
        fmt::format("assimp cannot read it ({}): it is damaged, or of a version that assimp does not "
                    "know; export it anew, or as STL",
                    reason(importer.GetErrorString())));
  AssimpReader reader(*scene, job, job.format == "fbx" ? fbx_unit(*scene) : written_unit(job.format, text));
  if (amf)
    reader.show(amf_file);
  else
    reader.show_scene();
  ForeignMesh mesh = reader.mesh();
  if (x3d && reader.shown() != x3d_file.shapes)
    throw InputError(job.where,
                     fmt::format("assimp finds {} of its {} shapes: export it as another format, or as STL",
                                 reader.shown(), x3d_file.shapes));
  if (const std::vector<std::string> lost = reader.left_out(x3d_file.lines + dxf_lines); !lost.empty())
    warn(fmt::format("left out, for only shapes and colours are read: {}", fmt::join(lost, ", ")));
  if (const std::string doubt = doubts.told(); !doubt.empty()) warn(doubt);
  return mesh;
}

}  // namespace flexel::meshes
