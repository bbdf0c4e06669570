// What flexel-meshes does of its own with files of other people's formats: AMF read, X3D and DXF made fit for assimp.
#include "meshes/amf_reader.h"
#include "meshes/dxf_document.h"
#include "meshes/x3d_document.h"
#include "tests/fuzz/driver.h"

namespace {

using namespace flexel;

constexpr const char* kAmf =
    "<?xml version=\"1.0\"?><amf unit=\"millimeter\"><material "
    "id=\"5\"><color><r>1</r><g>0.5</g><b>0</b></color></material>"
    "<object id=\"1\"><mesh><vertices><vertex><coordinates><x>0</x><y>0</y><z>0</z></coordinates></vertex>"
    "<vertex><coordinates><x>1.5</x><y>0</y><z>0</z></coordinates></vertex>"
    "<vertex><coordinates><x>0</x><y>1</y><z>0</z></coordinates></vertex>"
    "<vertex><coordinates><x>0</x><y>0</y><z>1</z></coordinates></vertex>"
    "<edge><v1>0</v1><dx1>1</dx1></edge></vertices><volume materialid=\"5\">"
    "<triangle><v1>0</v1><v2>2</v2><v3>1</v3></triangle><triangle><v1>0</v1><v2>1</v2><v3>3</v3></triangle>"
    "<triangle><v1>1</v1><v2>2</v2><v3>3</v3></triangle><triangle><v1>2</v1><v2>0</v2><v3>3</v3></triangle></"
    "volume></mesh>"
    "</object><constellation id=\"2\"><instance "
    "objectid=\"1\"><deltax>100</deltax><rz>90</rz><scale>2</scale>"
    "<mirrory>1</mirrory></instance><instance objectid=\"1\"/></constellation></amf>";
constexpr const char* kX3d =
    "<?xml version=\"1.0\"?><X3D version=\"3.3\" profile=\"Interchange\"><head><unit category=\"length\" "
    "name=\"cm\" "
    "conversionFactor=\"0.01\"/></head><Scene><Transform DEF=\"first\"><Group "
    "DEF=\"g\"><Shape><IndexedFaceSet "
    "coordIndex=\"0 2 1 -1 0 1 3 -1 1 2 3 -1 2 0 3 -1\"><Coordinate point=\"0 0 0 1 0 0 0 1 0 0 0 "
    "1\"/></IndexedFaceSet></Shape>"
    "</Group></Transform><Switch whichChoice=\"0\"><Transform DEF=\"second\" translation=\"0.1 0.02 "
    "0.03\"><Group USE=\"g\"/>"
    "</Transform></Switch><LOD range=\"1 2\"><Group USE=\"g\"/><Group/></LOD></Scene></X3D>";
constexpr const char* kDxf =
    "0\nSECTION\n2\nHEADER\n9\n$"
    "INSUNITS\n70\n4\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n0\n3DFACE\n8\nwedge\n10\n0\n20\n0\n30\n0\n"
    "11\n1\n21\n0\n31\n0\n12\n0\n22\n1\n32\n0\n13\n0\n23\n1\n33\n0\n0\nPOLYLINE\n8\na\n66\n1\n70\n64\n71\n3\n"
    "72\n1\n0\nVERTEX\n"
    "8\na\n10\n0\n20\n0\n30\n0\n70\n192\n0\nVERTEX\n8\na\n10\n1\n20\n0\n30\n0\n70\n192\n0\nVERTEX\n8\na\n10\n"
    "0\n20\n1\n30\n0\n"
    "70\n192\n0\nVERTEX\n8\na\n10\n0\n20\n0\n30\n0\n70\n128\n71\n1\n72\n-"
    "2\n73\n3\n0\nSEQEND\n8\na\n0\nENDSEC\n0\nEOF\n";

void read_foreign_file(const std::string& path) {
  MeshReadJob job{"amf", "amf", read_all(path), path};
  const std::string_view text(reinterpret_cast<const char*>(job.bytes.data()), job.bytes.size());
  if (text.find("<X3D") != std::string_view::npos)
    (void)meshes::x3d_document(job.bytes, path);
  else if (text.find("SECTION") != std::string_view::npos)
    (void)meshes::dxf_document(text, path);
  else
    (void)meshes::read_amf(job, [](const std::string&) {});
}

}  // namespace

int main(int argc, char** argv) {
  return fuzz::run(argc, argv, "fuzz_foreign",
                   {fuzz::bytes_of(kAmf), fuzz::bytes_of(kX3d), fuzz::bytes_of(kDxf)}, read_foreign_file);
}
