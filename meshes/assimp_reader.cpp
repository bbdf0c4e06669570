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
#include <assimp/DefaultLogger.hpp>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <assimp/LogStream.hpp>
#include <assimp/Logger.hpp>
#include <cmath>
#include <set>
#include <utility>

#include "base/error.h"
#include "meshes/dxf_document.h"
#include "meshes/mesh_builder.h"
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

// By which assimp tells formats apart.
std::string file_name(const MeshReadJob& job) {
  return "part." + job.extension;
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

// Formats in which the transform of the topmost node is assimp's own: it turns y up, and applies units and scales that the
// other programs pass over (3DS) or that are ours to apply (Collada).
bool has_made_up_root(const std::string& format) {
  return format == "3ds" || format == "ase" || format == "dxf" || format == "dae";
}

bool has_texture(const aiMaterial* material) {
  if (material == nullptr) return false;
  for (int type = aiTextureType_DIFFUSE; type <= aiTextureType_UNKNOWN; ++type)
    if (material->GetTextureCount(static_cast<aiTextureType>(type)) > 0) return true;
  return false;
}

// What a reader before assimp found out of the file.
struct FileFacts {
  Bytes bytes;  // for assimp, where it gets others than the file's
  double unit = 0;
  std::vector<std::string> left_out;
  std::optional<std::size_t> shapes;  // how many it shows
};

class AssimpReader {
 public:
  AssimpReader(const aiScene& scene, const MeshReadJob& job) : scene_(scene), job_(job), mesh_(job.where) {}

  // What the scene shows, in the order of its nodes.
  void show() {
    const bool made_up = has_made_up_root(job_.format);
    std::vector<Shown> pending = {{scene_.mRootNode, Eigen::Matrix4d::Identity(), "", ""}};
    while (!pending.empty()) {
      const auto [node, above, name_above, assembly] = pending.back();
      pending.pop_back();
      check_inheritance(*node, above);
      const bool own = node != scene_.mRootNode || !made_up;
      const Eigen::Matrix4d transform =
          own ? Eigen::Matrix4d(above * matrix_of(node->mTransformation)) : above;
      const std::string name = name_of(*node, name_above);
      if (node->mNumMeshes > 0) add_part(*node, transform, name, assembly);
      const std::string below = own && node != scene_.mRootNode ? assembly_below(*node, assembly) : assembly;
      for (unsigned i = node->mNumChildren; i > 0; --i)
        pending.push_back({node->mChildren[i - 1], transform, name, below});
    }
  }

  [[nodiscard]] ForeignMesh finish(double unit) { return mesh_.finish(unit); }

  // How many meshes of polygons were shown.
  [[nodiscard]] std::size_t shown() const { return shown_; }

  // What is left out of the file, for one line; empty: nothing.
  [[nodiscard]] std::vector<std::string> left_out() const {
    std::vector<std::string> all;
    if (textures_ || coordinates_) all.emplace_back(textures_ ? "textures" : "texture coordinates");
    if (colors_within_) all.emplace_back("changes of colour within a polygon");
    if (bones_) all.emplace_back("skeletons");
    if (morphs_) all.emplace_back("morph targets");
    if (scene_.mNumAnimations > 0) all.emplace_back("animations");
    if (lines_ > 0) all.push_back(fmt::format("{} points and lines", lines_));
    return all;
  }

 private:
  // A node, and the transform, name and path of those above it.
  struct Shown {
    const aiNode* node;
    Eigen::Matrix4d above;
    std::string name, assembly;
  };

  // The path of what hangs on a node, which is an assembly then; not of one that assimp makes of FBX's pivots.
  [[nodiscard]] std::string assembly_below(const aiNode& node, const std::string& above) {
    std::string name = name_of(node, "");
    if (node.mNumChildren == 0 || name.empty() || name.find("_$AssimpFbx$_") != std::string::npos)
      return above;
    std::replace(name.begin(), name.end(), '/', '_');
    const std::string path = above.empty() ? name : above + "/" + name;
    std::string own = path;
    for (int use = 2; !assemblies_.insert(own).second; ++use) own = fmt::format("{}-{}", path, use);
    return own;
  }

  // FBX can keep a node from being scaled as the one above it is; assimp scales it.
  void check_inheritance(const aiNode& node, const Eigen::Matrix4d& above) const {
    std::int32_t kind = 1;
    constexpr int kWithoutScale = 2;
    if (node.mMetaData == nullptr || !node.mMetaData->Get("InheritType", kind) || kind != kWithoutScale)
      return;
    const Eigen::Matrix3d stretch = above.topLeftCorner<3, 3>();
    if (!(stretch.transpose() * stretch).isIdentity(1e-4))
      throw InputError(job_.where,
                       fmt::format("\"{}\" is not scaled as what it belongs to, which assimp does not read "
                                   "right: apply the scales before exporting, or export STL",
                                   clean_name(node.mName.C_Str())));
  }

  // The node's, its mesh's, or that of the nearest node above with one; none that assimp makes up ("<DXF_ROOT>").
  [[nodiscard]] std::string name_of(const aiNode& node, const std::string& above) const {
    std::string own = node.mName.C_Str();
    if (own.starts_with('<') || own.starts_with("$Collada") || own == file_name(job_)) own.clear();
    if (own.empty() && node.mNumMeshes > 0 && node.mMeshes[0] < scene_.mNumMeshes)
      own = scene_.mMeshes[node.mMeshes[0]]->mName.C_Str();
    return own.empty() ? above : own;
  }

  void add_part(const aiNode& node, const Eigen::Matrix4d& transform, const std::string& name,
                const std::string& assembly) {
    if (++uses_ > kMostUses) throw InputError(job_.where, "shows more than a million meshes: it is damaged");
    for (unsigned i = 0; i < node.mNumMeshes; ++i)
      if (node.mMeshes[i] < scene_.mNumMeshes) add_mesh(*scene_.mMeshes[node.mMeshes[i]], transform);
    mesh_.end_part(name, assembly);
  }

  void add_mesh(const aiMesh& mesh, const Eigen::Matrix4d& transform) {
    const bool mirrored = transform.topLeftCorner<3, 3>().determinant() < 0;
    const aiMaterial* material =
        mesh.mMaterialIndex < scene_.mNumMaterials ? scene_.mMaterials[mesh.mMaterialIndex] : nullptr;
    (has_texture(material) ? textures_ : coordinates_) |= mesh.HasTextureCoords(0);
    bones_ = bones_ || mesh.HasBones();
    morphs_ = morphs_ || mesh.mNumAnimMeshes > 0;
    mesh_.begin_group(material == nullptr ? "" : material->GetName().C_Str());
    const bool own_colors = mesh.HasVertexColors(0) && !is_blank(mesh);
    bool any = false;
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices < 3) {
        ++lines_;
        continue;
      }
      for (unsigned c = 0; c < face.mNumIndices; ++c)
        add_corner(mesh, face.mIndices[mirrored ? face.mNumIndices - 1 - c : c], transform);
      mesh_.end_polygon(own_colors ? color_of(mesh, face) : color_of(material));
      any = true;
    }
    shown_ += any ? 1 : 0;
  }

  void add_corner(const aiMesh& mesh, unsigned vertex, const Eigen::Matrix4d& transform) {
    if (vertex >= mesh.mNumVertices)
      throw InputError(job_.where,
                       fmt::format("is damaged: a polygon names vertex {} (from 0), but there are only {}",
                                   vertex, mesh.mNumVertices));
    const aiVector3D& at = mesh.mVertices[vertex];
    mesh_.add_corner(transform.topLeftCorner<3, 3>() * Vec3(at.x, at.y, at.z) +
                     transform.topRightCorner<3, 1>());
  }

  // The mean of the corners'.
  Rgba color_of(const aiMesh& mesh, const aiFace& face) {
    aiColor4D color(0, 0, 0, 0);
    const aiColor4D first = mesh.mColors[0][face.mIndices[0]];
    for (unsigned c = 0; c < face.mNumIndices; ++c) {
      color += mesh.mColors[0][face.mIndices[c]];
      colors_within_ = colors_within_ || mesh.mColors[0][face.mIndices[c]] != first;
    }
    color = color * (1 / static_cast<float>(face.mNumIndices));
    return Rgba{color.r, color.g, color.b, color.a};
  }

  static std::optional<Rgba> color_of(const aiMaterial* material) {
    aiColor4D color(0, 0, 0, 0);
    if (material == nullptr || material->GetName() == aiString(AI_DEFAULT_MATERIAL_NAME) ||
        material->Get(AI_MATKEY_COLOR_DIFFUSE, color) != aiReturn_SUCCESS)
      return std::nullopt;
    return Rgba{color.r, color.g, color.b, color.a};
  }

  // assimp makes colours for formats whose file has none: all zero, the opacity too.
  [[nodiscard]] static bool is_blank(const aiMesh& mesh) {
    return std::all_of(mesh.mColors[0], mesh.mColors[0] + mesh.mNumVertices,
                       [](const aiColor4D& color) { return color == aiColor4D(0, 0, 0, 0); });
  }

  const aiScene& scene_;
  const MeshReadJob& job_;
  MeshBuilder mesh_;
  std::size_t uses_ = 0, shown_ = 0, lines_ = 0;
  std::set<std::string> assemblies_;  // their paths
  bool colors_within_ = false, textures_ = false, coordinates_ = false, bones_ = false, morphs_ = false;
};

// What assimp says while it reads, but for what is of looks and movements: it may mean that a shape is missing.
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
    const bool of_looks = speaks_of("BlendDNA", "texture", "Texture", "material", "anim", "track", "light",
                                    "camera", "Lamp", "UV", "uv", "normal", "tangent", "color", "chunk",
                                    "shader", "version", "add reason", "EOF");
    if (!of_looks && count_++ == 0) first_ = clean_name(text.substr(0, 160));
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

// What assimp cannot be trusted with, mended or refused.
FileFacts facts_of(const MeshReadJob& job, const Warn& warn) {
  FileFacts facts;
  const std::string_view text(reinterpret_cast<const char*>(job.bytes.data()), job.bytes.size());
  facts.unit = written_unit(job.format, text, job.where);
  if (job.format == "x3d") {
    X3dDocument document = x3d_document(job.bytes, job.where);
    facts.bytes = std::move(document.bytes);
    facts.unit = document.unit;
    facts.shapes = document.shapes;
    facts.left_out = std::move(document.left_out);
  } else if (job.format == "dxf") {
    DxfDocument document = dxf_document(text, job.where);
    facts.bytes = std::move(document.bytes);
    facts.unit = document.unit;
    for (const auto& [kind, count] : document.others)
      facts.left_out.push_back(fmt::format("{} {}", count, clean_name(kind)));
  } else if (job.format == "dae") {
    for (const char* element : {"<trifans", "<lookat", "<skew", "<convex_mesh", "<brep"})
      if (text.find(element) != std::string_view::npos)
        throw InputError(
            job.where,
            fmt::format("holds {}>, which assimp does not read right: export it anew with triangles "
                        "and matrices, or as STL",
                        element));
  } else if (job.format == "ms3d") {
    facts.left_out.emplace_back("names of groups");  // assimp makes one node of all, without a name
  } else if (job.format == "blend") {
    warn("Blender's modifiers are read in part only: apply them before saving, or export STL");
  }
  return facts;
}

}  // namespace

ForeignMesh read_with_assimp(const MeshReadJob& job, const Warn& warn) {
  FileFacts facts = facts_of(job, warn);
  Doubts doubts;  // lives longer than the importer, which speaks at its end
  Assimp::Importer importer;
  importer.SetIOHandler(new OneFile(file_name(job), facts.bytes.empty() ? job.bytes : facts.bytes));
  importer.SetPropertyInteger(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, 1);
  const aiScene* scene = importer.ReadFile(file_name(job), 0);
  if (scene == nullptr || scene->mRootNode == nullptr)
    throw InputError(
        job.where,
        fmt::format("assimp cannot read it ({}): it is damaged, or of a version or kind that assimp does not "
                    "know; export it anew, or as STL",
                    reason(importer.GetErrorString())));
  AssimpReader reader(*scene, job);
  reader.show();
  if (facts.shapes && reader.shown() != *facts.shapes)
    throw InputError(job.where,
                     fmt::format("assimp finds {} of its {} shapes: export it as another format, or as STL",
                                 reader.shown(), *facts.shapes));
  ForeignMesh mesh = reader.finish(job.format == "fbx" ? fbx_unit(*scene) : facts.unit);
  std::vector<std::string> lost = reader.left_out();
  lost.insert(lost.end(), facts.left_out.begin(), facts.left_out.end());
  if (!lost.empty())
    warn(fmt::format("left out, for only shapes and colours are read: {}", fmt::join(lost, ", ")));
  if (const std::string doubt = doubts.told(); !doubt.empty()) warn(doubt);
  return mesh;
}

}  // namespace flexel::meshes
