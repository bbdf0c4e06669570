// Quantities with units. A unit is a product of named units with prefixes and powers ("kN/mm^2", "kg m^-3",
// "W/(m K)", "Nm"); its dimension is found by adding exponents, so that no list of all spellings is needed.
// Powers of ten are kept apart from the rest of a factor: "3 mm" is 3 / 1000, rounded once, and so equals
// 0.003 to the bit.
#include "base/units.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "base/error.h"
#include "base/nearest_word.h"
#include "base/number_range.h"

namespace flexel {
namespace {

// Exponents of length, mass, time, angle, temperature.
using Exponents = std::array<int, 5>;

// factor = mantissa * 10^decimals
struct Unit {
  double mantissa = 1;
  int decimals = 0;
  Exponents exponents{};
};

struct NamedUnit {
  const char* name;
  bool prefixed;  // takes SI prefixes
  bool word;      // written out: any case, plural with s
  Unit unit;
  double zero = 0;  // of a scale of temperatures, K
};

constexpr Exponents kLength{1}, kVolume{3}, kMass{0, 1}, kTime{0, 0, 1}, kAngle{0, 0, 0, 1}, kForce{1, 1, -2},
    kTorque{2, 1, -2}, kPressure{-1, 1, -2}, kShare{}, kTemperature{0, 0, 0, 0, 1}, kPower{2, 1, -3},
    kConductivity{1, 1, -3, 0, -1}, kHeatTransfer{0, 1, -3, 0, -1};

constexpr double kPi = 3.14159265358979323846;
constexpr double kPoundForce = 4.4482216152605;  // N, exact: 0.45359237 kg x 9.80665 m/s^2
constexpr double kIcePoint = 273.15, kFahrenheit = 5. / 9, kFahrenheitZero = 459.67 * 5 / 9;  // K
constexpr double kSquareInch = 0.0254 * 0.0254, kPsi = kPoundForce / kSquareInch;             // m^2, Pa

constexpr NamedUnit kNamedUnits[] = {
    {"m", true, false, {1, 0, kLength}},
    {"metre", true, true, {1, 0, kLength}},
    {"meter", true, true, {1, 0, kLength}},
    {"micron", false, true, {1, -6, kLength}},
    {"in", false, false, {254, -4, kLength}},
    {"inch", false, true, {254, -4, kLength}},
    {"inches", false, true, {254, -4, kLength}},
    {"mil", false, false, {254, -7, kLength}},
    {"thou", false, true, {254, -7, kLength}},
    {"ft", false, false, {3048, -4, kLength}},
    {"foot", false, true, {3048, -4, kLength}},
    {"feet", false, true, {3048, -4, kLength}},
    {"yd", false, false, {9144, -4, kLength}},
    {"yard", false, true, {9144, -4, kLength}},
    {"l", true, false, {1, -3, kVolume}},
    {"L", true, false, {1, -3, kVolume}},
    {"litre", true, true, {1, -3, kVolume}},
    {"liter", true, true, {1, -3, kVolume}},
    {"g", true, false, {1, -3, kMass}},
    {"gram", true, true, {1, -3, kMass}},
    {"t", false, false, {1, 3, kMass}},
    {"tonne", false, true, {1, 3, kMass}},
    {"lb", false, false, {45359237, -8, kMass}},
    {"pound", false, true, {45359237, -8, kMass}},
    {"oz", false, false, {28349523125, -12, kMass}},
    {"s", true, false, {1, 0, kTime}},
    {"second", true, true, {1, 0, kTime}},
    {"min", false, false, {60, 0, kTime}},
    {"minute", false, true, {60, 0, kTime}},
    {"h", false, false, {36, 2, kTime}},
    {"hour", false, true, {36, 2, kTime}},
    {"rad", true, false, {1, 0, kAngle}},
    {"radian", false, true, {1, 0, kAngle}},
    {"deg", false, false, {kPi / 180, 0, kAngle}},
    {"degree", false, true, {kPi / 180, 0, kAngle}},
    {"turn", false, true, {2 * kPi, 0, kAngle}},
    {"N", true, false, {1, 0, kForce}},
    {"newton", true, true, {1, 0, kForce}},
    {"lbf", false, false, {44482216152605, -13, kForce}},
    {"kgf", false, false, {980665, -5, kForce}},
    {"Nm", true, false, {1, 0, kTorque}},
    {"Ncm", true, false, {1, -2, kTorque}},
    {"Nmm", true, false, {1, -3, kTorque}},
    {"J", true, false, {1, 0, kTorque}},
    {"joule", true, true, {1, 0, kTorque}},
    {"Pa", true, false, {1, 0, kPressure}},
    {"pascal", true, true, {1, 0, kPressure}},
    {"bar", true, false, {1, 5, kPressure}},
    {"psi", false, false, {kPsi, 0, kPressure}},
    {"ksi", false, false, {kPsi, 3, kPressure}},
    {"%", false, false, {1, -2, kShare}},
    {"percent", false, true, {1, -2, kShare}},
    {"ppm", false, false, {1, -6, kShare}},
    {"K", true, false, {1, 0, kTemperature}},
    {"kelvin", true, true, {1, 0, kTemperature}},
    {"degC", false, false, {1, 0, kTemperature}, kIcePoint},
    {"C", false, false, {1, 0, kTemperature}, kIcePoint},
    {"degF", false, false, {kFahrenheit, 0, kTemperature}, kFahrenheitZero},
    {"F", false, false, {kFahrenheit, 0, kTemperature}, kFahrenheitZero},
    {"W", true, false, {1, 0, kPower}},
    {"watt", true, true, {1, 0, kPower}},
    // As tables of materials write them: K by itself, no millikelvin.
    {"W/mK", false, false, {1, 0, kConductivity}},
    {"W/m2K", false, false, {1, 0, kHeatTransfer}},
};

struct Prefix {
  const char* symbol;
  const char* word;
  int decimals;
};
constexpr Prefix kPrefixes[] = {{"n", "nano", -9},  {"u", "micro", -6}, {"m", "milli", -3},
                                {"c", "centi", -2}, {"d", "deci", -1},  {"k", "kilo", 3},
                                {"M", "mega", 6},   {"G", "giga", 9},   {"T", "tera", 12}};

struct DimensionEntry {
  const char* name;  // with its article: "a length"
  Exponents exponents;
  const char* example;
  std::vector<std::string> units;
};

// In the order of Dimension. Where two have the same exponents, kind() names the first.
const std::vector<DimensionEntry>& entries() {
  static const std::vector<DimensionEntry> all = {
      {"a length", kLength, "2 mm", {"mm", "cm", "m", "um", "nm", "km", "in", "ft", "mil", "yd"}},
      {"an area", {2}, "4 mm^2", {"mm^2", "cm^2", "m^2", "in^2"}},
      {"a volume", kVolume, "8 mm^3", {"mm^3", "cm^3", "m^3", "l", "ml", "in^3"}},
      {"a mass", kMass, "50 g", {"g", "kg", "mg", "t", "lb", "oz"}},
      {"a time", kTime, "10 ms", {"s", "ms", "us", "min", "h"}},
      {"an angle", kAngle, "30 deg", {"deg", "rad", "mrad", "turn"}},
      {"a force", kForce, "5 N", {"N", "kN", "mN", "MN", "lbf", "kgf"}},
      {"a torque", kTorque, "5 N m", {"N m", "Nm", "Nmm", "N mm", "kN m", "lbf in"}},
      {"a pressure", kPressure, "2 MPa", {"Pa", "kPa", "MPa", "GPa", "N/mm^2", "bar", "psi", "ksi"}},
      {"a density", {-3, 1}, "7850 kg/m^3", {"kg/m^3", "g/cm^3", "t/m^3", "lb/in^3"}},
      {"a velocity", {1, 0, -1}, "2 m/s", {"m/s", "mm/s", "km/h"}},
      {"an acceleration", {1, 0, -2}, "9.81 m/s^2", {"m/s^2", "mm/s^2"}},
      {"an energy", kTorque, "3 J", {"J", "mJ", "kJ", "N m"}},
      {"a share", kShare, "30 %", {"%"}},
      {"a gravitational constant", {3, -1, -2}, "6.674e-11 m^3/kg/s^2", {"m^3/kg/s^2", "N m^2/kg^2"}},
      {"a temperature", kTemperature, "20 degC", {"degC", "K", "degF"}},
      {"a difference of temperatures", kTemperature, "80 K", {"K", "degC", "degF"}},
      {"a temperature gradient", {-1, 0, 0, 0, 1}, "500 K/m", {"K/m", "K/mm", "K/cm"}},
      {"a coefficient of expansion", {0, 0, 0, 0, -1}, "12e-6 /K", {"/K", "1/K", "um/(m K)", "ppm/K"}},
      {"a power", kPower, "5 W", {"W", "mW", "kW"}},
      {"a heat flux", {0, 1, -3}, "1000 W/m2", {"W/m2", "kW/m2", "W/cm2", "W/mm2"}},
      {"a conductivity", kConductivity, "50 W/(m K)", {"W/(m K)", "mW/(mm K)"}},
      {"a coefficient of heat transfer", kHeatTransfer, "10 W/(m2 K)", {"W/(m2 K)"}},
  };
  return all;
}

const DimensionEntry& entry(Dimension dimension) {
  return entries()[static_cast<std::size_t>(dimension)];
}

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

std::string_view trim(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\n";
  const std::size_t begin = text.find_first_not_of(kBlank);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlank) - begin + 1);
}

// Signs beyond ASCII as their plain spelling: micro sign, Greek mu, degree, middle dot, superscripts.
std::string plain_spelling(std::string_view text) {
  constexpr std::pair<std::string_view, std::string_view> kSpellings[] = {
      {"\xC2\xB5", "u"},  {"\xCE\xBC", "u"},  {"\xC2\xB0", "deg"}, {"\xC2\xB7", "*"}, {"\xE2\x8B\x85", "*"},
      {"\xC2\xB2", "^2"}, {"\xC2\xB3", "^3"}, {"**", "^"},         {"\xC2\xA0", " "}, {"\xE2\x80\xAF", " "}};
  std::string result(text);
  for (const auto& [from, to] : kSpellings)
    for (std::size_t at = result.find(from); at != std::string::npos; at = result.find(from, at + to.size()))
      result.replace(at, from.size(), to);
  return result;
}

bool named(const NamedUnit& unit, std::string_view name) {
  if (name == unit.name) return true;
  if (!unit.word) return false;
  const std::string word = lower(name);
  return word == unit.name || word == std::string(unit.name) + "s";
}

std::optional<Unit> find_unit(std::string_view name) {
  for (const NamedUnit& unit : kNamedUnits)
    if (named(unit, name)) return unit.unit;
  for (const Prefix& prefix : kPrefixes) {
    for (const NamedUnit& unit : kNamedUnits) {
      if (!unit.prefixed) continue;
      const std::string_view start = unit.word ? prefix.word : prefix.symbol;
      const std::string begun =
          unit.word ? lower(name.substr(0, start.size())) : std::string(name.substr(0, start.size()));
      if (begun != start || !named(unit, name.substr(start.size()))) continue;
      Unit result = unit.unit;
      result.decimals += prefix.decimals;
      return result;
    }
  }
  return std::nullopt;
}

Unit power(const Unit& unit, int exponent) {
  Unit result{std::pow(unit.mantissa, exponent), unit.decimals * exponent, unit.exponents};
  for (int& e : result.exponents) e *= exponent;
  return result;
}

Unit product(const Unit& a, const Unit& b) {
  Unit result{a.mantissa * b.mantissa, a.decimals + b.decimals, a.exponents};
  for (std::size_t i = 0; i < result.exponents.size(); ++i) result.exponents[i] += b.exponents[i];
  return result;
}

// One named unit with its power: "mm^2", "s^-1", "cm3".
std::optional<Unit> parse_factor(std::string_view text) {
  const std::size_t split = text.find_first_of("^-0123456789");
  const std::optional<Unit> unit = find_unit(text.substr(0, split));
  if (!unit || split == std::string_view::npos) return unit;
  const std::string_view digits = text.substr(text[split] == '^' ? split + 1 : split);
  int exponent = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), exponent);
  constexpr int kMostPower = 4;
  if (error != std::errc() || end != digits.data() + digits.size() || std::abs(exponent) > kMostPower ||
      exponent == 0)
    return std::nullopt;
  return power(*unit, exponent);
}

// Factors joined by "*", " " or "/"; a "/" divides by the one factor after it, or by what is in parentheses
// there. One may begin it: "/K", "1/K".
std::optional<Unit> parse_product(std::string_view rest, bool within_parentheses) {
  Unit result;
  bool divide = !within_parentheses && (rest.starts_with("/") || rest.starts_with("1/"));
  if (divide) rest = trim(rest.substr(rest.find('/') + 1));
  while (!rest.empty()) {
    std::optional<Unit> factor;
    std::size_t end = std::min(rest.find_first_of("*/ "), rest.size());
    if (!within_parentheses && rest.front() == '(') {
      end = std::min(rest.find(')'), rest.size() - 1) + 1;
      factor = parse_product(trim(rest.substr(1, end - 2)), true);
      if (rest[end - 1] != ')') return std::nullopt;
    } else {
      factor = parse_factor(rest.substr(0, end));
    }
    if (!factor) return std::nullopt;
    result = product(result, divide ? power(*factor, -1) : *factor);
    rest = rest.substr(end);
    // What joins this factor to the next: at most one sign, with blanks around it.
    rest = rest.substr(std::min(rest.find_first_not_of(' '), rest.size()));
    if (rest.empty()) return result;
    divide = rest.front() == '/';
    if (rest.front() == '/' || rest.front() == '*') {
      rest = trim(rest.substr(1));
      if (rest.empty()) return std::nullopt;
    }
  }
  return std::nullopt;
}

std::optional<Unit> parse_unit(std::string_view text) {
  const std::string spelled = plain_spelling(trim(text));
  const std::optional<Unit> whole = find_unit(spelled);
  return whole ? whole : parse_product(spelled, false);
}

// Where the scale of a temperature begins, K; nothing for what is no scale ("K/m*m").
std::optional<double> zero_of_scale(std::string_view text) {
  const std::string spelled = plain_spelling(trim(text));
  for (const NamedUnit& unit : kNamedUnits)
    if (named(unit, spelled)) return unit.zero;
  if (find_unit(spelled)) return 0;  // with a prefix
  return std::nullopt;
}

double scaled(double value, const Unit& unit) {
  const double product = value * unit.mantissa;
  return unit.decimals < 0 ? product / std::pow(10.0, -unit.decimals)
                           : product * std::pow(10.0, unit.decimals);
}

std::string hint(std::string_view name, Dimension dimension) {
  std::vector<std::string> all = unit_names(dimension);
  const std::string own = did_you_mean(std::string(name), all);
  if (!own.empty()) return own;
  for (const DimensionEntry& other : entries()) all.insert(all.end(), other.units.begin(), other.units.end());
  const std::string any = did_you_mean(std::string(name), all);
  return any.empty() ? fmt::format("; units of {} are {}", dimension_name(dimension),
                                   fmt::join(unit_names(dimension), ", "))
                     : any;
}

// "a force", or "not a length" where the exponents are those of no dimension.
std::string kind(const Exponents& exponents, Dimension wanted) {
  for (const DimensionEntry& known : entries())
    if (known.exponents == exponents) return known.name;
  return fmt::format("not {}", entry(wanted).name);
}

Unit unit_of(std::string_view name, std::string_view text, Dimension dimension) {
  const std::optional<Unit> unit = parse_unit(name);
  if (!unit)
    throw InputError(
        fmt::format("unknown unit \"{}\" in \"{}\"{}", trim(name), text, hint(trim(name), dimension)));
  if (unit->exponents != entry(dimension).exponents)
    throw InputError(fmt::format("\"{}\" is {}; {} is needed, such as \"{}\"", text,
                                 kind(unit->exponents, dimension), entry(dimension).name,
                                 entry(dimension).example));
  return *unit;
}

}  // namespace

double parse_quantity(std::string_view text, Dimension dimension) {
  const std::string_view whole = trim(text);
  const DimensionEntry& wanted = entry(dimension);
  const char* begin = whole.data() + (!whole.empty() && whole.front() == '+' ? 1 : 0);
  double value = 0;
  const auto [end, error] = std::from_chars(begin, whole.data() + whole.size(), value);
  if (error == std::errc::result_out_of_range || (error == std::errc() && !std::isfinite(value)))
    throw InputError(fmt::format("\"{}\" is not a finite number", whole));
  if (error != std::errc())
    throw InputError(fmt::format("\"{}\" is not {}, such as \"{}\"", whole, wanted.name, wanted.example));
  const std::string_view name = trim(whole.substr(static_cast<std::size_t>(end - whole.data())));
  const auto within = [&](double number) {
    if (!is_readable_quantity(number))
      throw InputError(
          fmt::format("\"{}\" is too {}: a quantity is 0, or from 1e-35 to 1e35 in size in SI units", whole,
                      std::abs(number) > 1 ? "large" : "small"));
    return number;
  };
  const bool absolute = dimension == Dimension::temperature;
  if (name.empty() && ((value == 0 && !absolute) || dimension == Dimension::share)) return within(value);
  if (name.empty())
    throw InputError(
        fmt::format("\"{}\" has no unit: write {} such as \"{}\"", whole, wanted.name, wanted.example));
  const double result = scaled(value, unit_of(name, whole, dimension));
  if (!absolute) return within(result);
  const std::optional<double> zero = zero_of_scale(name);
  if (!zero)
    throw InputError(
        fmt::format("\"{}\" is on no scale of temperatures; write such as \"{}\"", whole, wanted.example));
  if (result + *zero < 0) throw InputError(fmt::format("\"{}\" is below absolute zero", whole));
  return within(result + *zero);
}

double length_unit(std::string_view name) {
  return scaled(1, unit_of(name, trim(name), Dimension::length));
}

std::vector<std::string> unit_names(Dimension dimension) {
  return entry(dimension).units;
}

const char* dimension_name(Dimension dimension) {
  const char* name = entry(dimension).name;
  while (*name++ != ' ') {
  }
  return name;
}

const char* dimension_example(Dimension dimension) {
  return entry(dimension).example;
}

}  // namespace flexel
