// Formats that are read through assimp: one part in each, as files made by hand, comes out in its place, size and axes.
#include <gmock/gmock.h>

#include <algorithm>
#include <numeric>

#include "formats/common/mesh_job.h"
#include "tests/formats/import_help.h"
#include "tests/formats/make_files.h"

namespace flexel::test {
namespace {

using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

// A wedge that is not its own mirror image: 40 x 10 x 5 mm, 1000 mm^3.
const std::vector<Vec3> kWedge = {{0, 0, 0}, {40, 0, 0}, {0, 10, 0}, {0, 0, 5}, {40, 0, 5}, {0, 10, 5}};
const std::vector<std::array<int, 3>> kTriangles = {{0, 2, 1}, {3, 4, 5}, {0, 1, 4}, {0, 4, 3},
                                                    {1, 2, 5}, {1, 5, 4}, {2, 0, 3}, {2, 3, 5}};

// The second use of it: turned by 90 degrees about z, then moved.
Vec3 second(const Vec3& at) {
  return Vec3(100 - at.y(), 20 + at.x(), 30 + at.z());
}

std::string numbers(double factor, const char* separator = " ") {
  std::string text;
  for (const Vec3& at : kWedge)
    for (int i = 0; i < 3; ++i) text += fmt::format("{}{}", factor * at[i], separator);
  return text;
}

std::string corners(const char* format) {
  std::string text;
  for (const auto& t : kTriangles) text += fmt::format(fmt::runtime(format), t[0], t[1], t[2]);
  return text;
}

std::string collada(const std::string& unit, const std::string& use) {
  return R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset>)" +
         unit + R"(<up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="w" name="w"><mesh><source id="p"><float_array id="a" count="18">)" +
         numbers(1) +
         R"(</float_array><technique_common><accessor source="#a" count="6" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices><triangles count="8">
<input semantic="VERTEX" source="#v" offset="0"/><p>)" +
         corners("{} {} {} ") +
         R"(</p></triangles></mesh></geometry></library_geometries><library_visual_scenes>
<visual_scene id="s"><node id="first" name="first"><instance_geometry url="#w"/></node>)" +
         use +
         R"(</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
}

constexpr const char* kColladaUse =
    R"(<node id="second" name="second"><matrix>0 -1 0 100 1 0 0 20 0 0 1 30 0 0 0 1</matrix><instance_geometry url="#w"/></node>)";

std::string x3d(const std::string& head, double factor, const std::string& more) {
  return R"(<?xml version="1.0"?><X3D version="3.3" profile="Interchange"><head>)" + head +
         R"(</head><Scene><Transform DEF="first"><Group DEF="g"><Shape><IndexedFaceSet coordIndex=")" +
         corners("{} {} {} -1 ") + R"("><Coordinate point=")" + numbers(factor) +
         R"("/></IndexedFaceSet></Shape></Group></Transform>)" + more + "</Scene></X3D>";
}

std::string amf() {
  std::string text = R"(<?xml version="1.0"?><amf unit="millimeter"><object id="1"><mesh><vertices>)";
  for (const Vec3& at : kWedge)
    text += fmt::format("<vertex><coordinates><x>{}</x><y>{}</y><z>{}</z></coordinates></vertex>", at.x(),
                        at.y(), at.z());
  return text + "</vertices><volume>" + corners("<triangle><v1>{}</v1><v2>{}</v2><v3>{}</v3></triangle>") +
         R"(</volume></mesh></object><constellation id="2"><instance objectid="1"><deltax>0</deltax></instance>
<instance objectid="1"><deltax>100</deltax><deltay>20</deltay><deltaz>30</deltaz><rz>90</rz></instance></constellation></amf>)";
}

std::string dxf_face(const std::string& layer, const std::array<Vec3, 3>& at) {
  std::string text = "0\n3DFACE\n8\n" + layer + "\n";
  for (int c = 0; c < 4; ++c)
    for (int i = 0; i < 3; ++i) text += fmt::format("{}\n{}\n", 10 * (i + 1) + c, at[std::min(c, 2)][i]);
  return text;
}

std::string dxf(int units) {
  std::string text =
      fmt::format("0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n{}\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n", units);
  for (const auto& t : kTriangles) text += dxf_face("wedge", {kWedge[t[0]], kWedge[t[1]], kWedge[t[2]]});
  return text + "0\nENDSEC\n0\nEOF\n";
}

std::string fbx(double centimetres) {
  std::string text = fmt::format(R"(; FBX 7.3.0 project file
FBXHeaderExtension:  {{
	FBXHeaderVersion: 1003
	FBXVersion: 7300
}}
GlobalSettings:  {{
	Version: 1000
	Properties70:  {{
		P: "UpAxis", "int", "Integer", "",2
		P: "UnitScaleFactor", "double", "Number", "",{}
	}}
}}
Objects:  {{
	Geometry: 1000, "Geometry::wedge", "Mesh" {{
		Vertices: *18 {{
			a: {}
		}}
		PolygonVertexIndex: *24 {{
			a: )",
                                 centimetres, numbers(1, ",").substr(0, numbers(1, ",").size() - 1));
  for (const auto& t : kTriangles)
    text += fmt::format("{}{},{},{}", &t == &kTriangles[0] ? "" : ",", t[0], t[1], -t[2] - 1);
  return text + R"(
		}
	}
	Model: 2000, "Model::first", "Mesh" {
		Version: 232
	}
	Model: 3000, "Model::second", "Mesh" {
		Version: 232
		Properties70:  {
			P: "Lcl Translation", "Lcl Translation", "", "A",100,20,30
			P: "Lcl Rotation", "Lcl Rotation", "", "A",0,0,90
		}
	}
}
Connections:  {
	C: "OO",2000,0
	C: "OO",3000,0
	C: "OO",1000,2000
	C: "OO",1000,3000
}
)";
}

std::string chunk(std::uint16_t id, const std::string& content) {
  const auto size = static_cast<std::uint32_t>(6 + content.size());
  return bytes_of(std::vector{id}) + bytes_of(std::vector{size}) + content;
}

std::string mesh_3ds(const std::string& name, bool turned) {
  std::vector<float> points;
  for (const Vec3& at : kWedge)
    for (int i = 0; i < 3; ++i) points.push_back(static_cast<float>((turned ? second(at) : at)[i]));
  std::vector<std::uint16_t> faces;
  for (const auto& t : kTriangles)
    for (const int number : {t[0], t[1], t[2], 7}) faces.push_back(static_cast<std::uint16_t>(number));
  const auto count = [](std::size_t n) { return bytes_of(std::vector{static_cast<std::uint16_t>(n)}); };
  return chunk(0x4000, name + '\0' +
                           chunk(0x4100, chunk(0x4110, count(6) + bytes_of(points)) +
                                             chunk(0x4120, count(8) + bytes_of(faces))));
}

// A number with its most significant byte first.
template <class Number>
std::string big(Number number) {
  const std::string bytes = bytes_of(std::vector{number});
  return {bytes.rbegin(), bytes.rend()};
}

std::string lwo_chunk(const std::string& tag, const std::string& content) {
  std::string text = tag;
  text += big(static_cast<std::uint32_t>(content.size()));
  text += content;
  text.append(content.size() % 2, '\0');
  return text;
}

// A layer "wedge" in metres; its axes are left-handed, and polygons clockwise.
std::string lwo() {
  const auto text_of = [](std::string name) { return name.append(name.size() % 2 == 0 ? 2 : 1, '\0'); };
  std::string points, polygons = "FACE", surfaces = "SURF", layer(16, '\0');
  for (const Vec3& at : kWedge)
    for (const double number : {at.x(), at.y(), -at.z()}) points += big(static_cast<float>(1e-3 * number));
  for (std::uint16_t n = 0; n < kTriangles.size(); ++n) {
    polygons += big(std::uint16_t{3});
    for (const int corner : {0, 2, 1})
      polygons += big(static_cast<std::uint16_t>(kTriangles[n][static_cast<std::size_t>(corner)]));
    surfaces += big(n);
    surfaces += big(std::uint16_t{0});
  }
  layer += text_of("wedge");
  std::string surface = text_of("grey");
  surface += text_of("");
  std::string text = "LWO2";
  text += lwo_chunk("TAGS", text_of("grey"));
  text += lwo_chunk("LAYR", layer);
  text += lwo_chunk("PNTS", points);
  text += lwo_chunk("POLS", polygons);
  text += lwo_chunk("PTAG", surfaces);
  text += lwo_chunk("SURF", surface);
  return lwo_chunk("FORM", text);
}

// Two groups of MilkShape, "first" and "second".
std::string ms3d() {
  const auto number = [](std::size_t value) {
    return bytes_of(std::vector{static_cast<std::uint16_t>(value)});
  };
  std::string points, faces, groups;
  for (std::size_t w = 0; w < 2; ++w) {
    for (const Vec3& each : kWedge) {
      const Vec3 at = w == 0 ? each : second(each);
      points += '\0';
      points += bytes_of(
          std::vector{static_cast<float>(at.x()), static_cast<float>(at.y()), static_cast<float>(at.z())});
      points.append("\xff\0", 2);  // no bone
    }
    for (const auto& t : kTriangles) {
      faces += number(0);
      for (const int corner : t) faces += number(static_cast<std::size_t>(corner) + 6 * w);
      faces.append(15 * sizeof(float), '\0');  // normals, texture coordinates
      faces += '\1';
      faces += static_cast<char>(w);
    }
    std::string name = w == 0 ? "first" : "second";
    name.resize(32, '\0');
    groups += '\0';
    groups += name;
    groups += number(kTriangles.size());
    for (std::size_t n = 0; n < kTriangles.size(); ++n) groups += number(n + kTriangles.size() * w);
    groups += '\xff';  // no material
  }
  std::string text = "MS3D000000";
  text += bytes_of(std::vector{std::int32_t{4}});
  text += number(12);
  text += points;
  text += number(16);
  text += faces;
  text += number(2);
  text += groups;
  text += number(0);  // materials
  text += bytes_of(std::vector{24.0F, 0.0F});
  text += bytes_of(std::vector{std::int32_t{1}});
  text += number(0);  // joints
  return text;
}

std::string three_ds() {
  return chunk(0x4d4d, chunk(0x3d3d, mesh_3ds("first", false) + mesh_3ds("second", true)));
}

// Corners of the triangles of one part, in mm, sorted.
std::vector<std::array<double, 9>> triangles_of(const Surface& surface, std::uint32_t part) {
  std::vector<std::array<double, 9>> all;
  for (std::size_t p = 0; p < surface.polygon_count(); ++p) {
    if (surface.polygon_part(p) != part) continue;
    std::array<std::array<double, 3>, 3> at{};
    for (std::size_t c = 0; c < 3; ++c)
      for (int i = 0; i < 3; ++i)
        at[c][static_cast<std::size_t>(i)] =
            std::round(1e6 * surface.vertices[surface.polygon(p)[c]][i]) / 1e3 + 0.0;
    std::rotate(at.begin(), std::min_element(at.begin(), at.end()), at.end());
    all.push_back({at[0][0], at[0][1], at[0][2], at[1][0], at[1][1], at[1][2], at[2][0], at[2][1], at[2][2]});
  }
  std::sort(all.begin(), all.end());
  return all;
}

Surface wedge_surface(bool turned, double factor = 1) {
  Surface surface;
  for (const Vec3& at : kWedge) surface.vertices.push_back(1e-3 * factor * (turned ? second(at) : at));
  surface.polygon_offsets = {0};
  for (const auto& t : kTriangles) {
    for (const int v : t) surface.polygon_vertices.push_back(static_cast<std::uint32_t>(v));
    surface.polygon_offsets.push_back(static_cast<std::uint32_t>(surface.polygon_vertices.size()));
    surface.polygon_face.push_back(0);
  }
  surface.faces = {{"", 0}};
  surface.parts = {{"wedge"}};
  return surface;
}

// Two uses, each the wedge in its place with its outside outside, of six vertices.
void expect_two_wedges(const Surface& surface, const std::string& format, double unit) {
  SCOPED_TRACE(format);
  ASSERT_EQ(surface.parts.size(), 2u);
  EXPECT_EQ(surface.vertices.size(), 12u);
  EXPECT_EQ(surface.sources[0].format, format);
  EXPECT_DOUBLE_EQ(surface.sources[0].unit, unit);
  for (std::uint32_t part = 0; part < 2; ++part)
    EXPECT_EQ(triangles_of(surface, part), triangles_of(wedge_surface(part == 1), 0)) << part;
}

TEST(ImportAssimp, EveryUseIsAPartInItsPlaceSizeAndAxes) {
  const Scratch scratch;
  const auto read = [&](const std::string& name, const std::string& text) {
    return import_surface(scratch.write(name, text));
  };
  const Surface dae = read("a.dae", collada(R"(<unit name="mm" meter="0.001"/>)", kColladaUse));
  expect_two_wedges(dae, "dae", 1e-3);
  EXPECT_EQ(dae.parts[1].name, "second");
  expect_two_wedges(
      read("a.x3d",
           x3d("", 1e-3, R"(<Transform DEF="second" translation="0.1 0.02 0.03" rotation="0 0 1 1.5707963268">
<Group USE="g"/></Transform>)")),
      "x3d", 1);
  expect_two_wedges(read("a.amf", amf()), "amf", 1e-3);
  expect_two_wedges(read("a.fbx", fbx(0.1)), "fbx", 1e-3);
  expect_two_wedges(read("a.3ds", three_ds()), "3ds", 1e-3);
  const Surface drawing = read("a.dxf", dxf(4));
  EXPECT_EQ(triangles_of(drawing, 0), triangles_of(wedge_surface(false), 0));
  EXPECT_EQ(drawing.vertices.size(), 6u);
}

TEST(ImportAssimp, NodesWithOthersBelowAreAssemblies) {
  const Scratch scratch;
  const std::string part = R"(<node id="a" name="pin"><instance_geometry url="#w"/></node>)",
                    joint = R"(<node id="joint/1" name="joint/1">)" + part + "</node>";
  const Surface surface =
      import_surface(scratch.write("a.dae", collada("", R"(<node id="arm" name="arm">)" + joint + joint +
                                                            R"(<node id="empty" name="empty"/></node>)")));
  std::vector<std::string> assemblies;
  for (const SurfacePart& each : surface.parts) assemblies.push_back(each.assembly);
  EXPECT_EQ(assemblies, (std::vector<std::string>{"", "arm/joint_1", "arm/joint_1-2"}));
}

TEST(ImportAssimp, FormatsAreToldByTheirBytes) {
  const Scratch scratch;
  const auto format = [&](const std::string& text) {
    return import_surface(scratch.write("nameless", text)).sources[0].format;
  };
  EXPECT_EQ(format(collada("", "")), "dae");
  EXPECT_EQ(format(x3d("", 1, "")), "x3d");
  EXPECT_EQ(format(amf()), "amf");
}

TEST(ImportAssimp, UnitsAreThoseOfTheFile) {
  const Scratch scratch;
  ImportOptions inches;
  inches.unit = 0.0254;
  const auto unit = [&](const std::string& name, const std::string& text, const ImportOptions& options = {}) {
    const Surface surface = import_surface(scratch.write(name, text), options);
    EXPECT_NEAR(surface.vertices[surface.polygon(0)[2]].x(), 40 * surface.sources[0].unit, 1e-9) << name;
    return surface.sources[0].unit;
  };
  EXPECT_DOUBLE_EQ(unit("a.dae", collada(R"(<unit name="inch" meter='2.54e-2' />)", "")), 0.0254);
  EXPECT_DOUBLE_EQ(unit("b.dae", collada("", "")), 1);
  EXPECT_DOUBLE_EQ(
      unit("a.x3d",
           x3d(R"(<unit category="angle" name="d" conversionFactor="1"/><unit category="length" name="cm"
 conversionFactor="0.01"/>)",
               1, "")),
      0.01);
  EXPECT_DOUBLE_EQ(unit("a.amf", replaced(amf(), "millimeter", "inch")), 0.0254);
  EXPECT_DOUBLE_EQ(unit("b.amf", replaced(amf(), R"( unit="millimeter")", "")), 1e-3);
  EXPECT_DOUBLE_EQ(unit("a.fbx", fbx(2.54)), 0.0254);
  EXPECT_DOUBLE_EQ(unit("a.dxf", dxf(1)), 0.0254);
  EXPECT_DOUBLE_EQ(unit("b.dxf", dxf(0)), 1e-3);
  EXPECT_DOUBLE_EQ(unit("c.dxf", dxf(0), inches), 0.0254);
  EXPECT_DOUBLE_EQ(unit("a.3ds", three_ds(), inches), 0.0254);
  EXPECT_THAT(import_error(scratch.write("d.dxf", dxf(4)), inches),
              HasSubstr("carries its own unit: leave out --unit"));
}

TEST(ImportAssimp, X3dIsReadOnAfterAGroupThatIsUsedAgainOrEmpty) {
  const Scratch scratch;
  const std::string more =
      R"(<Transform><Group/><Transform translation="1 0 0"><Group USE="g"/></Transform></Transform>
<Transform translation="2 0 0"><Group USE="g"/></Transform><Transform DEF="last" translation="3 0 0"><Group USE="g"/></Transform>)";
  const Surface surface = import_surface(scratch.write("a.x3d", x3d("", 1e-3, more)));
  ASSERT_EQ(surface.parts.size(), 4u);
  EXPECT_EQ(surface.parts[3].name, "last");
  for (std::uint32_t part = 0; part < 4; ++part) {
    double least = 1e9;
    for (const auto& triangle : triangles_of(surface, part)) least = std::min(least, triangle[0]);
    EXPECT_NEAR(least, 1000.0 * part, 1e-3);
  }
  EXPECT_THAT(import_error(scratch.write("b.x3d", x3d("", 1, R"(<Group USE="no"/>)"))), HasSubstr("\"no\""));
  std::string bomb = x3d("", 1, "");
  std::string groups;
  for (int i = 0; i < 40; ++i)
    groups += fmt::format(R"(<Group DEF="g{}"><Group USE="g{}"/><Group USE="g{}"/></Group>)", i,
                          i == 0 ? "" : std::to_string(i - 1), i == 0 ? "" : std::to_string(i - 1));
  EXPECT_THAT(import_error(scratch.write("c.x3d", x3d("", 1, groups))), HasSubstr("more than two million"));
}

TEST(ImportAmf, InstancesAreScaledMirroredAndHidden) {
  const Scratch scratch;
  const Surface scaled = import_surface(scratch.write(
      "a.amf", replaced(amf(), "<rz>90</rz>", "<scale>2</scale><scalex>3</scalex><mirrory>1</mirrory>")));
  Surface wanted = wedge_surface(false);
  for (Vec3& at : wanted.vertices) at = 1e-3 * Vec3(100, 20, 30) + Vec3(6 * at.x(), -2 * at.y(), 2 * at.z());
  for (std::size_t c = 0; c < wanted.polygon_vertices.size(); c += 3)
    std::swap(wanted.polygon_vertices[c + 1], wanted.polygon_vertices[c + 2]);
  EXPECT_EQ(triangles_of(scaled, 1), triangles_of(wanted, 0));
  std::vector<std::string> lines;
  ImportOptions options;
  options.warn = [&](const std::string& line) { lines.push_back(line); };
  EXPECT_EQ(import_surface(scratch.write("b.amf", replaced(amf(), "<rz>90</rz>", "<printable>0</printable>")),
                           options)
                .parts.size(),
            1u);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_THAT(lines[0], HasSubstr("not to be printed"));
  EXPECT_THAT(import_error(scratch.write("c.amf", replaced(amf(), "<rz>90</rz>", "<shear>1</shear>"))),
              HasSubstr("<shear>"));
}

TEST(ImportAmf, EveryVolumeIsAPart) {
  const Scratch scratch;
  std::string twice = replaced(
      amf(), "</volume>",
      R"(</volume><volume><metadata type="name">lid</metadata><color><r>1</r><g>0.5</g><b>0</b></color>)" +
          corners("<triangle><v1>{}</v1><v2>{}</v2><v3>{}</v3></triangle>") + "</volume>");
  const Surface surface = import_surface(scratch.write("a.amf", twice));
  ASSERT_EQ(surface.parts.size(), 4u);
  EXPECT_EQ(surface.parts[1].name, "lid");
  EXPECT_EQ(triangles_of(surface, 2), triangles_of(surface, 3));
  const Column& color = surface.polygon_columns.at(kColorColumn);
  EXPECT_EQ(color.values[0], 1);            // white: no colour of its own
  EXPECT_EQ(color.values[4 * 8 + 1], 0.5);  // the second part's
  EXPECT_THAT(
      import_error(scratch.write("b.amf", replaced(amf(), "</object>", R"(</object><object id="1"/>)"))),
      HasSubstr("two objects"));
  EXPECT_THAT(import_error(scratch.write("c.amf", replaced(amf(), "<x>40</x>", "<x>40,5</x>"))),
              HasSubstr("\"40,5\" is not a finite number"));
  EXPECT_THAT(import_error(scratch.write("d.amf", replaced(amf(), "millimeter", "cubit"))),
              HasSubstr("unknown unit \"cubit\""));
  EXPECT_EQ(import_surface(scratch.write("e.amf", replaced(amf(), "<amf unit=\"millimeter\"",
                                                           "<!-- <amf unit=\"feet\"> --><amf unit=\"Inch\"")))
                .sources[0]
                .unit,
            0.0254);
  EXPECT_EQ(import_surface(scratch.write("f.amf", zip({{"part.amf", amf()}}))).parts.size(), 2u);
}

TEST(ImportAssimp, ColladaWithWhatAssimpMisreadsIsRefusedOrTold) {
  const Scratch scratch;
  const std::string whole = collada("", "");
  EXPECT_THAT(import_error(scratch.write(
                  "a.dae", replaced(replaced(whole, "<triangles", "<trifans"), "</triangles", "</trifans"))),
              HasSubstr("<trifans>"));
  EXPECT_THAT(import_error(scratch.write("b.dae", collada(R"(<unit meter="-1"/>)", ""))),
              HasSubstr("positive number"));
  std::vector<std::string> lines;
  ImportOptions options;
  options.warn = [&](const std::string& line) { lines.push_back(line); };
  (void)import_surface(
      scratch.write("c.dae", collada("", R"(<node id="n"><instance_geometry url="#absent"/></node>)")),
      options);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_THAT(lines[0], HasSubstr("see that no shape is missing"));
}

TEST(ImportAssimp, X3dSwitchesUnitsAndColours) {
  const Scratch scratch;
  const std::string shape = R"(<Shape><Box size="9 9 9"/></Shape>)";
  const auto parts = [&](const std::string& more) {
    return import_surface(scratch.write("a.x3d", x3d("", 1, more))).parts.size();
  };
  EXPECT_EQ(parts(R"(<Switch whichChoice="0"><Group/>)" + shape + "</Switch>"), 1u);
  EXPECT_EQ(parts(R"(<Switch whichChoice="1"><Group/>)" + shape + "</Switch>"), 2u);
  EXPECT_EQ(parts("<Switch>" + shape + "</Switch>"), 1u);
  EXPECT_EQ(parts("<LOD>" + shape + shape + "</LOD>"), 2u);
  EXPECT_EQ(parts(R"(<Group visible="false">)" + shape + "</Group>"), 1u);
  EXPECT_THAT(import_error(scratch.write("e.x3d", x3d("", 1, "<Shape><Cone/></Shape>"))),
              HasSubstr("holds a Cone"));
  EXPECT_THAT(
      import_error(scratch.write(
          "b.x3d",
          x3d("", 1,
              R"(<Shape><IndexedQuadSet index="0 1 2 3"><Coordinate point="0 0 0 1 0 0 1 1 0 0 1 0"/></IndexedQuadSet></Shape>)"))),
      HasSubstr("1 of its 2 shapes"));
  EXPECT_THAT(import_error(scratch.write(
                  "c.x3d", x3d(R"(<unit category="angle" name="d" conversionFactor="0.01745"/>)", 1, ""))),
              HasSubstr("radians"));
  const Surface colored =
      import_surface(scratch.write("d.x3d", replaced(x3d("", 1, ""), R"(<IndexedFaceSet )",
                                                     R"(<IndexedFaceSet colorPerVertex="false" )")));
  EXPECT_EQ(colored.parts.size(), 1u);
}

TEST(ImportAssimp, DxfFacesWithInvisibleEdgesAreReadAndACutFileIsNot) {
  const Scratch scratch;
  std::string mesh =
      "0\nSECTION\n2\nENTITIES\n0\nPOLYLINE\n8\nw\n66\n1\n70\n64\n71\n6\n72\n8\n10\n0\n20\n0\n30\n0\n";
  for (const Vec3& at : kWedge)
    mesh += fmt::format("0\nVERTEX\n8\nw\n10\n{}\n20\n{}\n30\n{}\n70\n192\n", at.x(), at.y(), at.z());
  for (const auto& t : kTriangles)
    mesh += fmt::format("0\nVERTEX\n8\nw\n10\n0\n20\n0\n30\n0\n70\n128\n71\n{}\n72\n-{}\n73\n{}\n", t[0] + 1,
                        t[1] + 1, t[2] + 1);
  mesh += "0\nSEQEND\n8\nw\n0\nENDSEC\n0\nEOF\n";
  const Surface surface = import_surface(scratch.write("a.dxf", mesh));
  EXPECT_EQ(triangles_of(surface, 0), triangles_of(wedge_surface(false), 0));
  EXPECT_THAT(import_error(scratch.write("b.dxf", replaced(mesh, "0\nEOF\n", ""))), HasSubstr("is cut off"));
  const std::string sheet = dxf_face("sheet", {Vec3(0, 0, 0), Vec3(900, 0, 0), Vec3(0, 900, 0)}) + "67\n1\n";
  EXPECT_EQ(import_surface(scratch.write("d.dxf", replaced(mesh, "0\nPOLYLINE\n", sheet + "0\nPOLYLINE\n")))
                .polygon_count(),
            8u);
  EXPECT_THAT(import_error(scratch.write("c.dxf", dxf(99))), HasSubstr("unit number 99"));
}

TEST(ImportAssimp, MasterScalesAreNotApplied) {
  const Scratch scratch;
  const float scale = 25.4F;
  const std::string scaled =
      chunk(0x4d4d, chunk(0x3d3d, chunk(0x0100, bytes_of(std::vector{scale})) + mesh_3ds("first", false)));
  EXPECT_EQ(triangles_of(import_surface(scratch.write("a.3ds", scaled)), 0),
            triangles_of(wedge_surface(false), 0));
}

TEST(ImportAssimp, BytesComeBeforeExtensions) {
  const Scratch scratch;
  const std::string stl =
      "solid <amf unit\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 "
      "0\nendloop\nendfacet\nendsolid\n";
  EXPECT_EQ(import_surface(scratch.write("a.prt", stl)).sources[0].format, "stl-ascii");
  EXPECT_EQ(
      import_surface(scratch.write("b.obj", "# from a <COLLADA file\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"))
          .sources[0]
          .format,
      "obj");
}

TEST(ImportAssimp, WhatIsLeftOutIsTold) {
  const Scratch scratch;
  std::vector<std::string> lines;
  ImportOptions options;
  options.warn = [&](const std::string& line) { lines.push_back(line); };
  const std::string line =
      R"(<Shape><IndexedLineSet coordIndex="0 1 2 -1"><Coordinate point="0 0 0 1 0 0 1 1 0"/></IndexedLineSet></Shape>)";
  EXPECT_EQ(import_surface(scratch.write("a.x3d", x3d("", 1, line)), options).parts.size(), 1u);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_THAT(lines[0], HasSubstr("IndexedLineSet"));
}

TEST(ImportAssimp, LightWaveHasMetresALayersNameAndTheOtherHand) {
  const Scratch scratch;
  const Surface surface = import_surface(scratch.write("a.lwo", lwo()));
  ASSERT_EQ(surface.parts.size(), 1u);
  EXPECT_EQ(surface.parts[0].name, "wedge");
  EXPECT_EQ(surface.sources[0].format, "lwo");
  EXPECT_DOUBLE_EQ(surface.sources[0].unit, 1);
  EXPECT_EQ(triangles_of(surface, 0), triangles_of(wedge_surface(false), 0));
}

TEST(ImportAssimp, MilkShapeIsOnePartWithoutTheNamesOfItsGroups) {
  const Scratch scratch;
  std::vector<std::string> lines;
  ImportOptions options;
  options.warn = [&](const std::string& line) { lines.push_back(line); };
  options.unit = 1e-3;
  const Surface surface = import_surface(scratch.write("a.ms3d", ms3d()), options);
  ASSERT_EQ(surface.parts.size(), 1u);
  EXPECT_EQ(surface.sources[0].format, "ms3d");
  std::vector<std::array<double, 9>> both = triangles_of(wedge_surface(false), 0);
  for (const std::array<double, 9>& triangle : triangles_of(wedge_surface(true), 0)) both.push_back(triangle);
  std::sort(both.begin(), both.end());
  EXPECT_EQ(triangles_of(surface, 0), both);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_THAT(lines[0], HasSubstr("names of groups"));
}

TEST(ImportAssimp, DamageIsOneLine) {
  const Scratch scratch;
  const std::string whole[] = {
      collada("", kColladaUse), x3d("", 1, ""), amf(), dxf(4), fbx(1), three_ds(), lwo(), ms3d()};
  const char* extensions[] = {"dae", "x3d", "amf", "dxf", "fbx", "3ds", "lwo", "ms3d"};
  for (std::size_t f = 0; f < 8; ++f)
    for (const std::size_t share : {3, 7}) {
      const std::string path = scratch.write(fmt::format("cut{}.{}", share, extensions[f]),
                                             whole[f].substr(0, whole[f].size() * share / 10));
      try {
        const Surface surface = import_surface(path);
        EXPECT_GT(surface.polygon_count(), 0u);  // some formats are sound without their end
      } catch (const InputError& error) {
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
      }
    }
  EXPECT_THAT(import_error(scratch.write("a.fbx", "; FBX 7.3.0 project file\n")),
              HasSubstr("assimp cannot read it"));
}

TEST(ImportAssimp, NothingElseIsOpened) {
  const Scratch scratch;
  scratch.write("part.x3d", x3d("", 1, ""));  // what assimp is told that the file is called
  EXPECT_THAT(import_error(scratch.write("a.x3d", x3d("", 1, R"(<Inline url="part.x3d"/>)"))),
              HasSubstr("is not opened"));
}

TEST(ImportAssimp, DxfWithWhatAssimpDropsIsRefused) {
  const Scratch scratch;
  const auto with = [&](const std::string& entity) {
    return scratch.write("a.dxf", replaced(dxf(4), "2\nENTITIES\n", "2\nENTITIES\n" + entity));
  };
  EXPECT_THAT(import_error(with("  0\nINSERT\n  8\n0\n  2\nb\n 50\n90\n")),
              HasSubstr("(INSERT), which assimp"));
  EXPECT_THAT(import_error(with("0\r\n3DSOLID\r\n8\r\n0\r\n")), HasSubstr("solids (3DSOLID)"));
  EXPECT_THAT(import_error(with("0\nPOLYLINE\n8\n0\n66\n1\n70\n17\n0\nSEQEND\n")),
              HasSubstr("polygon meshes"));
  EXPECT_EQ(import_surface(with("0\nTEXT\n8\n0\n1\nINSERT\n")).parts.size(), 1u);
}

TEST(ImportAmf, InstancesAreTurnedAboutXThenYThenZ) {
  const Scratch scratch;
  const std::string turns = "<rx>90</rx><ry>90</ry><rz>90</rz>";
  const Surface surface = import_surface(scratch.write("a.amf", replaced(amf(), "<rz>90</rz>", turns)));
  // (x, y, z) to (x, -z, y), to (y, -z, -x), to (z, y, -x), and moved
  Surface wanted = wedge_surface(false);
  for (Vec3& at : wanted.vertices) at = 1e-3 * Vec3(100, 20, 30) + Vec3(at.z(), at.y(), -at.x());
  EXPECT_EQ(triangles_of(surface, 1), triangles_of(wanted, 0));
  const std::string loop =
      R"(<constellation id="3"><instance objectid="4"/></constellation><constellation id="4"><instance objectid="3"/></constellation><constellation id="5"><instance objectid="3"/></constellation></amf>)";
  EXPECT_THAT(import_error(scratch.write("b.amf", replaced(amf(), "</amf>", loop))),
              HasSubstr("contain one another"));
}

TEST(ImportVdb, WhatIsNoGridIsRefused) {
  const Scratch scratch;
  const std::string mark("\x20\x42\x44\x56\0\0\0\0", 8);
  EXPECT_THAT(import_error(scratch.write("a.vdb", mark + std::string(200, 'x'))), HasSubstr("is damaged"));
}

TEST(UnreadFormats, TheWayOutIsNamed) {
  const Scratch scratch;
  const auto why = [&](const std::string& name, const std::string& text) {
    return import_error(scratch.write(name, text));
  };
  EXPECT_THAT(why("a.ifc", "ISO-10303-21;\nHEADER;FILE_SCHEMA(('IFC4'));ENDSEC;"), HasSubstr("IfcConvert"));
  EXPECT_THAT(why("a.stp", "ISO-10303-21;\nHEADER;\nFILE_SCHEMA (('IFC2X3'));\nENDSEC;"),
              HasSubstr("IfcConvert"));
  EXPECT_THAT(why("a.jt", "Version 9.5 JT  DM 6.4.1.0"), HasSubstr("CAD Assistant"));
  EXPECT_THAT(why("a.SLDPRT", "anything"), HasSubstr("part of SolidWorks"));
}

}  // namespace
}  // namespace flexel::test
