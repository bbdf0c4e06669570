// Writing .vtu. Raw: all sizes are known beforehand, so the head with every offset comes first and the arrays
// are streamed after it, straight from memory where they lie as they are written. Compressed: offsets depend
// on the packed sizes, so the arrays are packed before the head is written. Offsets are plain digits and
// arrays follow each other without gaps, as meshio requires.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <iterator>
#include <limits>
#include <stdexcept>

#include "base/files/output_file.h"
#include "base/parallel.h"
#include "formats/vtu/vtu.h"
#include "formats/vtu/vtu_head.h"

namespace flexel::vtu {
namespace {

constexpr std::size_t kChunkBytes = std::size_t{1} << 20, kPieceBytes = std::size_t{1} << 18;

template <class Use>
void for_each_chunk(const Array& array, const Use& use) {
  if (array.memory != nullptr || array.size() == 0) {
    use(array.memory, array.size());
    return;
  }
  const std::size_t step = std::max<std::size_t>(1, kChunkBytes / array.tuple_size());
  Bytes chunk(step * array.tuple_size());
  for (std::size_t begin = 0; begin < array.tuples; begin += step) {
    const std::size_t end = std::min(array.tuples, begin + step);
    parallel_chunks(end - begin, std::max<std::size_t>(1, kPieceBytes / array.tuple_size()),
                    [&](std::size_t first, std::size_t last) {
                      array.make(begin + first, begin + last, chunk.data() + first * array.tuple_size());
                    });
    use(chunk.data(), (end - begin) * array.tuple_size());
  }
}

}  // namespace

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

namespace {

// One component is not said, as VTK does: readers then give a plain list instead of a table of one column.
std::string tag(const Array& array, std::uint64_t offset) {
  std::string text = fmt::format("<DataArray type=\"{}\" Name=\"{}\"", array.type, escaped(array.name));
  if (array.components != 1) text += fmt::format(" NumberOfComponents=\"{}\"", array.components);
  if (array.section == Section::field) text += fmt::format(" NumberOfTuples=\"{}\"", array.tuples);
  return text + fmt::format(" format=\"appended\" offset=\"{}\"/>\n", offset);
}

std::string section_tags(const char* element, Section section, const std::vector<Array>& arrays,
                         const std::vector<std::uint64_t>& offsets) {
  const bool numbered =
      section == Section::point_data && std::any_of(arrays.begin(), arrays.end(), [](const Array& array) {
        return array.section == Section::point_data && array.name == kGlobalPointIds;
      });
  std::string text = numbered ? fmt::format("<{} GlobalIds=\"{}\">\n", element, kGlobalPointIds)
                              : fmt::format("<{}>\n", element);
  for (std::size_t i = 0; i < arrays.size(); ++i)
    if (arrays[i].section == section) text += tag(arrays[i], offsets[i]);
  return text + fmt::format("</{}>\n", element);
}

std::string head(std::size_t points, std::size_t cells, const std::vector<Array>& arrays,
                 const std::vector<std::uint64_t>& offsets, bool compress) {
  std::string text = fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" "
      "byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\"{}>\n<UnstructuredGrid>\n",
      compress ? " compressor=\"vtkZLibDataCompressor\"" : "");
  text += section_tags("FieldData", Section::field, arrays, offsets);
  text += fmt::format("<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n", points, cells);
  text += section_tags("PointData", Section::point_data, arrays, offsets);
  text += section_tags("CellData", Section::cell_data, arrays, offsets);
  text += section_tags("Points", Section::points, arrays, offsets);
  text += section_tags("Cells", Section::cells, arrays, offsets);
  return text + "</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_";
}

const char* tail() {
  return "\n</AppendedData>\n</VTKFile>\n";
}

void write_number(OutputFile& output, std::uint64_t value) {
  output.write(&value, sizeof value);
}

void write_raw(OutputFile& output, std::size_t points, std::size_t cells, const std::vector<Array>& arrays) {
  std::vector<std::uint64_t> offsets(arrays.size());
  std::uint64_t at = 0;
  for (std::size_t i = arrays.size(); i-- > 0;) {
    offsets[i] = at;
    at += sizeof(std::uint64_t) + arrays[i].size();
  }
  output.write(head(points, cells, arrays, offsets, false));
  for (std::size_t i = arrays.size(); i-- > 0;) {
    write_number(output, arrays[i].size());
    for_each_chunk(arrays[i], [&](const void* data, std::size_t size) { output.write(data, size); });
  }
}

// The array in VTK's compressed form: number of blocks, size of a block, size of the last where it is shorter
// (else 0), the blocks' packed sizes, the blocks.
PackedBlocks pack_array(const Array& array) {
  Bytes plain;
  plain.reserve(array.size());
  for_each_chunk(array, [&](const void* data, std::size_t size) {
    const std::byte* bytes = static_cast<const std::byte*>(data);
    plain.insert(plain.end(), bytes, bytes + size);
  });
  constexpr int kLevel = 6;
  return pack_blocks(plain, kLevel);
}

void write_compressed(OutputFile& output, std::size_t points, std::size_t cells,
                      const std::vector<Array>& arrays) {
  std::vector<PackedBlocks> packed(arrays.size());
  std::vector<std::uint64_t> offsets(arrays.size());
  std::uint64_t at = 0;
  for (std::size_t i = arrays.size(); i-- > 0;) {
    packed[i] = pack_array(arrays[i]);
    offsets[i] = at;
    at += sizeof(std::uint64_t) * (3 + packed[i].sizes.size()) + packed[i].bytes.size();
  }
  output.write(head(points, cells, arrays, offsets, true));
  for (std::size_t i = arrays.size(); i-- > 0;) {
    write_number(output, packed[i].sizes.size());
    write_number(output, kBlockSize);
    write_number(output, arrays[i].size() % kBlockSize);
    output.write(packed[i].sizes.data(), packed[i].sizes.size() * sizeof(std::uint64_t));
    output.write(packed[i].bytes.data(), packed[i].bytes.size());
  }
}

}  // namespace

PackedBlocks pack_blocks(std::span<const std::byte> data, int level) {
  const std::size_t count = (data.size() + kBlockSize - 1) / kBlockSize;
  std::vector<Bytes> blocks(count);
  parallel_for_each(
      count,
      [&](std::size_t b) {
        const std::size_t begin = b * kBlockSize;
        blocks[b] = compress(data.subspan(begin, std::min(kBlockSize, data.size() - begin)), level);
      },
      1);
  PackedBlocks result;
  for (const Bytes& block : blocks) {
    result.sizes.push_back(block.size());
    result.bytes.insert(result.bytes.end(), block.begin(), block.end());
  }
  return result;
}

// The data lie in the opposite order of their tags: meshio renumbers the tags' offsets one after the other
// and looks each up by its number, which would else be taken by one that it has renumbered before.
void write(OutputFile& output, std::size_t points, std::size_t cells, const std::vector<Array>& given,
           bool compress) {
  std::vector<Array> arrays;
  for (const Section section :
       {Section::field, Section::point_data, Section::cell_data, Section::points, Section::cells})
    std::copy_if(given.begin(), given.end(), std::back_inserter(arrays),
                 [&](const Array& array) { return array.section == section; });
  if (compress)
    write_compressed(output, points, cells, arrays);
  else
    write_raw(output, points, cells, arrays);
  output.write(std::string(tail()));
}

}  // namespace flexel::vtu
