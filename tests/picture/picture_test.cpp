// The whole picture: views, ranges, exaggeration, labels, what is refused.
#include "flexel/picture/picture.h"
#include "flexel/picture/canvas/png_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>

#include "../mapping/bodies.h"
#include "base/error.h"
#include "base/program/silent_updates.h"
#include "flexel/picture/canvas/colour_map.h"
#include "flexel/picture/canvas/text.h"
#include "flexel/picture/render/camera.h"
#include "flexel/picture/render/quantity.h"
#include "scenes.h"

namespace flexel::picture {
namespace {

using testing::HasSubstr;

template <class Call>
std::string refusal(const Call& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

PictureOptions small(const View& view = {}) {
  PictureOptions options;
  options.width = 400;
  options.height = 300;
  options.view = view;
  return options;
}

std::vector<double> shares_told;

// Its triangles are split before it is drawn.
TEST(PictureProgress, OfABentBodyWithLongTrianglesNeverGoesBack) {
  Body bar = mapping::test::block(40, 4, 4, 0.001, Placement::corner, 1);
  bar.surface_cell_offsets.clear();
  bar.surface_cells.clear();
  mapping::test::deform(bar, [](const Vec3& x) {
    constexpr double kRadius = 0.04;
    return Vec3((kRadius - x.z()) * std::sin(x.x() / kRadius), x.y(),
                kRadius - (kRadius - x.z()) * std::cos(x.x() / kRadius));
  });
  PictureSubject bent;
  bent.label = bent.where = "bent";
  bent.body = bar;
  PictureOptions options = small();
  options.view.reset();  // it is chosen
  shares_told.clear();
  set_silent_update([](const Progress&, double share, const std::string&) { shares_told.push_back(share); });
  Progress quiet("test", Progress::Mode::quiet);
  (void)draw_picture({bent}, options, quiet);
  set_silent_update(nullptr);
  EXPECT_GT(shares_told.size(), 100u);
  EXPECT_TRUE(std::is_sorted(shares_told.begin(), shares_told.end()));
  EXPECT_NEAR(shares_told.back(), 1, 1e-12);
}

TEST(Views, NamedOnesLookAlongTheAxes) {
  const auto forward = [](const char* name) { return camera_towards(*parse_view(name)).forward; };
  EXPECT_LT((forward("front") - Vec3f(0, 1, 0)).norm(), 1e-6);
  EXPECT_LT((forward("back") - Vec3f(0, -1, 0)).norm(), 1e-6);
  EXPECT_LT((forward("right") - Vec3f(-1, 0, 0)).norm(), 1e-6);
  EXPECT_LT((forward("left") - Vec3f(1, 0, 0)).norm(), 1e-6);
  EXPECT_LT((forward("top") - Vec3f(0, 0, -1)).norm(), 1e-6);
  EXPECT_LT((forward("bottom") - Vec3f(0, 0, 1)).norm(), 1e-6);
  EXPECT_LT((forward("iso") - Vec3f(-1, 1, -1).normalized()).norm(), 1e-6);
  EXPECT_LT((camera_towards(*parse_view("top")).up - Vec3f(0, 1, 0)).norm(), 1e-6);
  EXPECT_FALSE(parse_view("auto"));
  const auto up = [](Up axis) { return camera_towards({0, 0, axis}).up; };
  EXPECT_EQ(up(Up::x), Vec3f::UnitX());
  EXPECT_EQ(up(Up::y), Vec3f::UnitY());
  EXPECT_LT((camera_towards({0, 0, Up::y}).forward + Vec3f::UnitZ()).norm(), 1e-6);
  for (const Up axis : {Up::x, Up::y, Up::z})
    for (double azimuth = -180; azimuth < 180; azimuth += 17)
      for (double elevation = -90; elevation <= 90; elevation += 15) {
        const Camera c = camera_towards({azimuth, elevation, axis});
        Eigen::Matrix3f base;
        base << c.right, c.up, -c.forward;
        EXPECT_LT((base.transpose() * base - Eigen::Matrix3f::Identity()).norm(), 1e-5);
        EXPECT_NEAR(base.determinant(), 1, 1e-5);
      }
}

TEST(Views, WrongOnesAreRefused) {
  EXPECT_THAT(refusal([] { (void)parse_view("frnt"); }), HasSubstr("front"));
  EXPECT_THAT(refusal([] { (void)parse_view("10;20"); }), HasSubstr("AZIMUTH,ELEVATION"));
  for (const char* wrong : {"10,100", "a,b", "10,", ",", "nan,0", "1e400,0", "10,20,30"})
    EXPECT_THAT(refusal([&] { (void)parse_view(wrong); }), HasSubstr("degrees")) << wrong;
}

TEST(Ticks, AreRoundAndInsideAndFew) {
  for (const double low : {-7.3e-9, -1.0, 0.0, 0.2, 12345.0})
    for (const double span : {1e-12, 3.7e-6, 0.9, 1.0, 52.8, 1e9}) {
      if (span < 1e-6 * std::abs(low)) continue;  // beyond what doubles tell apart well
      const Ticks ticks = round_ticks(low, low + span, 7);
      ASSERT_GE(ticks.values.size(), 2u) << low << " " << span;
      ASSERT_LE(ticks.values.size(), 7u);
      const double apart = ticks.values[1] - ticks.values[0];
      const double power = std::pow(10, std::floor(std::log10(apart * (1 + 1e-6))));
      const double mantissa = std::round(apart / power), step = mantissa * power;
      EXPECT_TRUE(mantissa == 1 || mantissa == 2 || mantissa == 5) << apart;
      EXPECT_NEAR(apart, step, 1e-5 * step);
      for (std::size_t i = 0; i < ticks.values.size(); ++i) {
        EXPECT_GE(ticks.values[i], low - 1e-5 * span);
        EXPECT_LE(ticks.values[i], low + span * (1 + 1e-5));
        EXPECT_NEAR(std::remainder(ticks.values[i], step), 0, 1e-6 * step);
        EXPECT_NEAR(std::stod(ticks.labels[i]), ticks.values[i], 1e-6 * step);
      }
    }
  EXPECT_TRUE(round_ticks(1, 1, 7).values.empty());
  EXPECT_TRUE(round_ticks(1e20, 1e20 + 1e5, 7).values.empty());
  EXPECT_TRUE(round_ticks(0, std::nan(""), 7).values.empty());
}

TEST(Ticks, UnitsFitTheValues) {
  EXPECT_EQ(display_unit(Dimension::length, 5.3e-3).name, "mm");
  EXPECT_EQ(display_unit(Dimension::length, 12e-6).name, "µm");
  EXPECT_EQ(display_unit(Dimension::pressure, 3e8).name, "MPa");
  EXPECT_EQ(display_unit(Dimension::share, 0.3).name, "%");
  EXPECT_EQ(display_unit(std::nullopt, 0.3).name, "");
  EXPECT_EQ(display_unit(std::nullopt, 4e7).factor, 1e6);
  EXPECT_EQ(dimension_of("von_mises"), Dimension::pressure);
  EXPECT_EQ(dimension_of("plastic_strain"), Dimension::share);
  EXPECT_EQ(dimension_of("velocity.z"), Dimension::velocity);
  EXPECT_EQ(dimension_of("quality"), std::nullopt);
  EXPECT_EQ(dimension_of("distance_class"), std::nullopt);  // of a file: holds a known word, and is none
}

TEST(ColourMap, BrightnessRisesEvenly) {
  // CIE lightness of the map's colours: rising, its steps within a factor of two.
  const auto lightness = [](float t) {
    const double y = to_linear(colour_of(t)).cast<double>().dot(Eigen::Vector3d(0.2126, 0.7152, 0.0722));
    return 116 * std::cbrt(y) - 16;
  };
  const double mean = (lightness(1) - lightness(0)) / 50;
  for (int i = 0; i < 50; ++i) {
    const double step = lightness(static_cast<float>(i + 1) / 50) - lightness(static_cast<float>(i) / 50);
    EXPECT_GT(step, 0.5 * mean) << i;
    EXPECT_LT(step, 2 * mean) << i;
  }
  // Viridis itself at both ends and in the middle.
  EXPECT_LT((colour_of(0) - colour(0x440154)).norm(), 0.03f);
  EXPECT_LT((colour_of(0.5f) - colour(0x21918c)).norm(), 0.03f);
  EXPECT_LT((colour_of(1) - colour(0xfde725)).norm(), 0.03f);
}

TEST(Text, IsDrawnWhereItIsMeasured) {
  Image image(300, 60, colour(0xffffff));
  const std::string text = "displacement 5 µm";
  draw_text(image, 20, 40, text, 24, colour(0x000000));
  int left = 300, right = 0;
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 300; ++x)
      if (image.pixels[image.index(x, y)].x() < 0.5f) {
        left = std::min(left, x);
        right = std::max(right, x);
      }
  EXPECT_NEAR(left, 21, 3);
  EXPECT_NEAR(right, 20 + text_width(text, 24), 4);
  EXPECT_LE(text_width(shortened("a_very_long_name_of_a_part.stl", 20, 120), 20), 120);
  EXPECT_EQ(shortened("short", 20, 500), "short");
  EXPECT_GT(text_width("\xff\xfe broken", 20), 0);
}

TEST(Picture, TheScaleIsTheSameForPanelsOfLikeSize) {
  // A part of half the size covers a quarter of the area.
  const Image image = test::picture(
      {test::subject(test::sphere({0, 0, 0}, 1, 3)), test::subject(test::sphere({9, 9, 9}, 0.5, 3))},
      small());
  std::array<double, 2> area{};
  const Colour paper = image.pixels.front();
  for (int y = 30; y < 220; ++y)
    for (int x = 0; x < 400; ++x) area[x < 200 ? 0 : 1] += image.pixels[image.index(x, y)] != paper;
  EXPECT_NEAR(area[0] / area[1], 4, 0.4);
}

TEST(Picture, WhatIsNotThereIsRefusedWithWhatIs) {
  Surface surface = test::box({0, 0, 0}, {1, 1, 1});
  surface.vertex_columns["quality"] = {1, std::vector<double>(8, 0.5)};
  PictureOptions options = small();
  const auto draw = [&] { (void)test::picture({test::subject(surface)}, options); };
  options.colour = "qualty";
  EXPECT_THAT(refusal(draw), HasSubstr("did you mean \"quality\""));
  options.colour = "displacement";
  EXPECT_THAT(refusal(draw), HasSubstr("--color takes quality, thickness, none"));
  options.colour = "quality";
  EXPECT_EQ(refusal(draw), "");
  options.range = {"1", "1"};
  EXPECT_THAT(refusal(draw), HasSubstr("not below"));
  options.range = {"0", "x"};
  EXPECT_THAT(refusal(draw), HasSubstr("not a number"));
  options.colour = "thickness";
  options.range = {"0", "2"};
  EXPECT_THAT(refusal(draw), HasSubstr("no unit"));
  options.colour = std::nullopt;
  EXPECT_THAT(refusal(draw), HasSubstr("--range needs a --color"));
  options.range = std::nullopt;
  options.show = PictureOptions::Show::cells;
  EXPECT_THAT(refusal(draw), HasSubstr("body"));
}

TEST(Picture, ThicknessOfAPlateIsItsOwn) {
  // 3 mm thick all over but for its rim: the picture from above has one colour, that of 3 mm.
  PictureOptions options = small({0, 90});
  options.colour = "thickness";
  options.range = {"0", "6 mm"};
  const Image image = test::picture({test::subject(test::box({0, 0, 0}, {0.4, 0.3, 0.003}))}, options);
  const Colour seen = to_linear(image.pixels[image.index(120, 120)]), wanted = to_linear(colour_of(0.5f));
  const float factor = seen.dot(wanted) / wanted.squaredNorm();
  EXPECT_LT((seen - factor * wanted).norm(), 0.03f);
}

TEST(Picture, OwnColoursAreShown) {
  Surface surface = test::box({0, 0, 0}, {1, 1, 1});
  Column red{3, {}};
  for (int v = 0; v < 8; ++v) red.values.insert(red.values.end(), {0.9, 0.1, 0.1});
  surface.vertex_columns[kColorColumn] = red;
  const Image image = test::picture({test::subject(surface)}, small());
  const Colour seen = image.pixels[image.index(200, 90)];
  EXPECT_GT(seen.x(), 2 * seen.y());
  EXPECT_GT(seen.x(), 2 * seen.z());
}

TEST(Picture, PngRoundTrips) {
  const Bytes bytes = encode_png(Image(70, 64, colour(0x123456)));
  ASSERT_GT(bytes.size(), 50u);
  EXPECT_EQ(static_cast<char>(bytes[1]), 'P');
}

}  // namespace
}  // namespace flexel::picture
