#include "base/units.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <tuple>

#include "base/error.h"

namespace flexel {
namespace {

using testing::HasSubstr;

constexpr int kLast = static_cast<int>(Dimension::heat_transfer);

std::string quantity_failure(const std::string& text, Dimension dimension) {
  try {
    (void)parse_quantity(text, dimension);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Units, EqualWhatTheyShouldToTheBit) {
  EXPECT_EQ(parse_quantity("3 mm", Dimension::length), 0.003);
  EXPECT_EQ(parse_quantity("1 in", Dimension::length), 0.0254);
  EXPECT_EQ(parse_quantity("12 um", Dimension::length), 12e-6);
  EXPECT_EQ(parse_quantity("7.85 g/cm^3", Dimension::density), 7850);
  EXPECT_EQ(parse_quantity("210 GPa", Dimension::pressure), 210e9);
  EXPECT_EQ(parse_quantity("1 N/mm^2", Dimension::pressure), 1e6);
  EXPECT_EQ(parse_quantity("9.81 m/s^2", Dimension::acceleration), 9.81);
  EXPECT_EQ(parse_quantity("36 km/h", Dimension::velocity), 10);
  EXPECT_EQ(parse_quantity("5 Nmm", Dimension::torque), 0.005);
  EXPECT_EQ(parse_quantity("30 %", Dimension::share), 0.3);
  EXPECT_EQ(parse_quantity("0.3", Dimension::share), 0.3);
  EXPECT_EQ(parse_quantity("2 min", Dimension::time), 120);
  EXPECT_DOUBLE_EQ(parse_quantity("180 deg", Dimension::angle), 3.14159265358979323846);
  EXPECT_DOUBLE_EQ(parse_quantity("1 psi", Dimension::pressure), 6894.757293168361);
  EXPECT_DOUBLE_EQ(parse_quantity("1 lbf/in^2", Dimension::pressure), 6894.757293168361);
}

TEST(Units, TemperaturesHaveAZeroAndTheirDifferencesNone) {
  for (const char* freezing : {"0 degC", "273.15 K", "32 degF", "0 C", "32 F",
                               "0 \xC2\xB0"
                               "C",
                               "273150 mK"})
    EXPECT_DOUBLE_EQ(parse_quantity(freezing, Dimension::temperature), 273.15) << freezing;
  EXPECT_EQ(parse_quantity("20 degC", Dimension::temperature_difference), 20);
  EXPECT_EQ(parse_quantity("-300 degC", Dimension::temperature_difference), -300);
  EXPECT_EQ(parse_quantity("18 degF", Dimension::temperature_difference), 10);
  EXPECT_EQ(parse_quantity("5 K/mm", Dimension::temperature_gradient), 5000);
  EXPECT_THAT(quantity_failure("-300 degC", Dimension::temperature), HasSubstr("below absolute zero"));
  EXPECT_THAT(quantity_failure("-1 K", Dimension::temperature), HasSubstr("below absolute zero"));
  EXPECT_THAT(quantity_failure("0", Dimension::temperature), HasSubstr("has no unit"));
  for (const char* no_scale : {"20 degC^1", "20 K m/m", "20 (K)", "20 1/K^-1"})
    EXPECT_NE(quantity_failure(no_scale, Dimension::temperature), "") << no_scale;
}

TEST(Units, OfHeat) {
  const std::vector<std::tuple<Dimension, double, std::vector<const char*>>> same = {
      {Dimension::expansion,
       12e-6,
       {"12e-6 /K", "12e-6/K", "12e-6 1/K", "12 ppm/K", "12 um/(m K)", "12 um/m/K", "12e-6 K^-1"}},
      {Dimension::conductivity,
       50,
       {"50 W/(m K)", "50 W/(m*K)", "50 W/m/K", "50 W/mK", "50 mW/(mm K)", "50 W m^-1 K^-1"}},
      {Dimension::heat_transfer, 10, {"10 W/(m2 K)", "10 W/(m^2 K)", "10 W/m2/K", "10 W/m2K", "10 kg/s^3/K"}},
      {Dimension::heat_flux, 1000, {"1000 W/m2", "1000 W/m^2", "1 kW/m2", "1e-3 W/mm2", "0.1 W/cm2"}},
      {Dimension::power, 5, {"5 W", "5000 mW", "5 J/s", "5 watts", "0.005 kW"}}};
  for (const auto& [dimension, value, spellings] : same)
    for (const char* text : spellings) EXPECT_DOUBLE_EQ(parse_quantity(text, dimension), value) << text;
  EXPECT_THAT(quantity_failure("50 W/m2", Dimension::conductivity),
              HasSubstr("is a heat flux; a conductivity"));
  for (const char* wrong : {"5 W/(m K", "5 W/m K)", "5 W/()", "5 W/((m K))", "5 W/(m K)2", "5 W/(/m K)",
                            "5 W//(m K)", "5 (W", "5 ("})
    EXPECT_NE(quantity_failure(wrong, Dimension::conductivity), "") << wrong;
}

TEST(Units, SpellingsOfOneUnitAgree) {
  const std::vector<std::vector<std::string>> spellings = {
      {"2.5 um", "2.5um", " 2.5 \xC2\xB5m ", "2.5 \xCE\xBCm", "+2.5 micron", "2.5 Micrometres",
       "25e-1 micrometer"},
      {"7 in", "7 inch", "7 inches", "7 Inch"},
  };
  for (const auto& group : spellings)
    for (const std::string& text : group)
      EXPECT_EQ(parse_quantity(text, Dimension::length), parse_quantity(group.front(), Dimension::length))
          << text;
  for (const char* text : {"3 kN m", "3 kNm", "3 kN*m", "3 kN \xC2\xB7 m", "3 kJ", "3 kilonewton metre"})
    EXPECT_EQ(parse_quantity(text, Dimension::torque), 3000) << text;
  for (const char* text : {"4 m/s^2", "4 m/s2", "4 m/s/s", "4 m s^-2", "4 m/s\xC2\xB2"})
    EXPECT_EQ(parse_quantity(text, Dimension::acceleration), 4) << text;
}

TEST(Units, EveryListedNameIsReadAndEveryOtherDimensionRefusesIt) {
  for (int d = 0; d <= kLast; ++d) {
    const Dimension dimension = static_cast<Dimension>(d);
    for (const std::string& name : unit_names(dimension)) {
      EXPECT_GT(parse_quantity("1 " + name, dimension), 0) << name;
      for (int o = 0; o <= kLast; ++o) {
        const Dimension other = static_cast<Dimension>(o);
        const auto are = [&](Dimension one, Dimension two) {
          return (dimension == one && other == two) || (dimension == two && other == one);
        };
        const bool same_kind = o == d || are(Dimension::torque, Dimension::energy) ||
                               are(Dimension::temperature, Dimension::temperature_difference);
        if (same_kind) continue;
        EXPECT_THAT(quantity_failure("1 " + name, other), HasSubstr("is needed")) << name;
      }
    }
  }
}

TEST(Units, ValueIsLinearInTheNumber) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> number(-1e6, 1e6);
  for (int n = 0; n < 1000; ++n) {
    const double value = number(random);
    char text[64];
    std::snprintf(text, sizeof text, "%.17g mm", value);
    EXPECT_EQ(parse_quantity(text, Dimension::length), value / 1000);
  }
}

TEST(Units, MessagesSayWhatToWrite) {
  EXPECT_THAT(quantity_failure("5 N", Dimension::length),
              HasSubstr("\"5 N\" is a force; a length is needed"));
  EXPECT_THAT(quantity_failure("5", Dimension::length), HasSubstr("has no unit"));
  EXPECT_THAT(quantity_failure("5 mmm", Dimension::length), HasSubstr("did you mean \"mm\""));
  EXPECT_THAT(quantity_failure("5 Mpa", Dimension::pressure), HasSubstr("did you mean \"MPa\""));
  EXPECT_THAT(quantity_failure("5 furlongs", Dimension::length), HasSubstr("unknown unit \"furlongs\""));
  EXPECT_THAT(quantity_failure("abc", Dimension::force), HasSubstr("such as \"5 N\""));
  EXPECT_THAT(quantity_failure("mm", Dimension::length), HasSubstr("is not a length"));
  EXPECT_THAT(quantity_failure("5 N^2", Dimension::force), HasSubstr("is not a force"));
}

TEST(Units, WhatIsNotAFiniteQuantityIsRefused) {
  for (const char* text :
       {"", " ", "nan mm", "inf mm", "-inf mm", "1e999 mm", "1e308 km", "1e-999 mm", "1,5 mm", "1 mm mm^",
        "1 /mm", "1 mm/", "1 mm//s", "1 mm^0", "1 mm^999999999999", "1 ^2", "--1 mm", "0x10 mm", "1 m m"})
    EXPECT_NE(quantity_failure(text, Dimension::length), "") << text;
}

TEST(Units, ZeroNeedsNoUnit) {
  for (int d = 0; d <= kLast; ++d) {
    const Dimension dimension = static_cast<Dimension>(d);
    if (dimension == Dimension::temperature) continue;
    for (const char* zero : {"0", "0.0", "-0"}) EXPECT_EQ(parse_quantity(zero, dimension), 0);
  }
}

TEST(Units, LengthUnits) {
  EXPECT_EQ(length_unit("mm"), 1e-3);
  EXPECT_EQ(length_unit("Millimetre"), 1e-3);
  EXPECT_EQ(length_unit("foot"), 0.3048);
  EXPECT_THROW((void)length_unit("kg"), InputError);
  EXPECT_THROW((void)length_unit(""), InputError);
}

TEST(Units, HumanLengthReadsBackWithinThreeDigits) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> exponent(-8.9, 5);
  for (int n = 0; n < 2000; ++n) {
    const double length = std::pow(10.0, exponent(random));
    EXPECT_NEAR(parse_quantity(human_length(length), Dimension::length) / length, 1, 5.1e-3)
        << human_length(length);
    EXPECT_NEAR(parse_quantity(human_force(length), Dimension::force) / length, 1, length < 1e-6 ? 1 : 5.1e-3)
        << human_force(length);
  }
}

TEST(Units, ForPeople) {
  EXPECT_EQ(human_length(0.00184), "1.84 mm");
  EXPECT_EQ(human_length(0.9999), "1 m");
  EXPECT_EQ(human_length(0), "0 mm");
  EXPECT_EQ(human_volume(1.234e-5), "12.3 cm^3");
  EXPECT_EQ(human_bytes(34.2e6), "34.2 MB");
  EXPECT_EQ(human_force(-1234), "-1.23 kN");
  EXPECT_EQ(human_count(51234), "51,234");
  EXPECT_EQ(human_count(999), "999");
  EXPECT_EQ(human_count(1000000), "1,000,000");
}

}  // namespace
}  // namespace flexel
