// What CLI11 throws becomes an InputError, with the nearest option.
#include "base/program/arguments.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <optional>
#include <string_view>

#include "base/error.h"
#include "base/files/files.h"
#include "base/nearest_word.h"
#include "base/program/standard_output.h"
#include "base/resources.h"
#include "base/stop.h"
#include "base/text.h"
#include "base/units.h"
#include "base/version.h"

namespace flexel {
namespace {

constexpr std::string_view kDescribe = "--describe-arguments";

void collect_options(const CLI::App& app, std::vector<std::string>& names) {
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
  }
  for (const CLI::App* subcommand : app.get_subcommands()) collect_options(*subcommand, names);
}

[[noreturn]] void refuse_extras(const CLI::App& app, const std::vector<std::string>& extras) {
  const std::string word =
      extras.empty() ? std::string() : extras.front().substr(0, extras.front().find('='));
  if (word.size() < 2 || word.front() != '-')
    throw InputError(fmt::format("unexpected argument \"{}\"; --help shows what is accepted", word));
  std::vector<std::string> names;
  collect_options(app, names);
  const std::string hint = did_you_mean(word, names);
  throw InputError(
      fmt::format("unknown option \"{}\"{}", word, hint.empty() ? "; --help lists the options" : hint));
}

// CLI11 takes the next argument for the value of "--unit=". `-o ""` is a script's variable that was never set.
void refuse_empty_values(int argc, char** argv) {
  for (int a = 1; a < argc && std::string_view(argv[a]) != "--"; ++a) {
    const std::string_view word = argv[a];
    if (word.starts_with("--") && word.ends_with('=') && word.find('=') == word.size() - 1)
      throw InputError(fmt::format("{}: its value is empty; --help shows what is accepted",
                                   word.substr(0, word.size() - 1)));
    if (word.empty() && a > 1 && argv[a - 1][0] == '-')
      throw InputError(fmt::format("{}: its value is empty; --help shows what is accepted", argv[a - 1]));
  }
}

// CLI11 writes "--no-x{false}" of flags that switch something off: how it stores them, which helps nobody.
std::string without_false(std::string text) {
  static constexpr std::string_view kFalse = "{false}";
  for (std::size_t at = 0; (at = text.find(kFalse, at)) != std::string::npos;)
    text.replace(at, kFalse.size(), kFalse.size(), ' ');
  return text;
}

// A line an argument, its fields set apart by tabs: kind, names, value ("" of a flag), default, description. From these
// lines man pages and completions are made (tools/interface-files).
std::string described(const CLI::App& app) {
  std::string text = fmt::format("command\t{}\t\t\t{}\n", app.get_name(), one_line(app.get_description()));
  for (const CLI::Option* option : app.get_options()) {
    const bool positional = option->get_positional();
    const std::string value = option->get_items_expected_max() == 0 ? "" : option->get_type_name();
    const std::string many = option->get_items_expected_max() > 1 && !value.empty() ? " ..." : "";
    text += fmt::format("{}\t{}\t{}{}\t{}\t{}\n", positional ? "argument" : "option",
                        without_false(option->get_name(positional, !positional)), value, many,
                        one_line(option->get_default_str()), one_line(option->get_description()));
  }
  return text;
}

// Bytes from "4GB", "512 MiB" or a plain number of bytes.
double parse_bytes(const std::string& text) {
  std::size_t end = 0;
  double value = -1;
  try {
    value = std::stod(text, &end);
  } catch (const std::exception&) {
    throw InputError("--max-memory: \"" + text + "\" is not a number of bytes, for example 4GB");
  }
  std::string unit = text.substr(end);
  unit.erase(0, unit.find_first_not_of(' '));
  const std::vector<std::string> units = {"", "B", "kB", "MB", "GB", "TB", "KiB", "MiB", "GiB", "TiB"};
  const double factors[] = {1, 1, 1e3, 1e6, 1e9, 1e12, 1024., 1048576., 1073741824., 1099511627776.};
  for (std::size_t n = 0; n < units.size(); ++n)
    if (unit == units[n] && value > 0 && value < 1e30) return value * factors[n];
  throw InputError("--max-memory: \"" + text + "\" is not an amount of memory, for example 4GB" +
                   did_you_mean(unit, units));
}

}  // namespace

struct CommandLine::Limits {
  std::string timeout, memory;
  std::optional<long long> elements;
  std::optional<StopAfter> stop;

  void declare(CLI::App& app) {
    app.add_option("--timeout", timeout, "Stop after this time (\"90 s\", \"5 min\"): exit 5")
        ->type_name("TIME");
    app.add_option(
           "--max-memory", memory,
           "Take no more than this (\"4GB\"); where a need is known beforehand, more is refused at once")
        ->type_name("BYTES");
    app.add_option("--max-elements", elements, "Refuse bodies of more elements")->type_name("COUNT");
  }
  void begin() {
    if (!memory.empty()) limit_memory(parse_bytes(memory));
    if (elements && *elements <= 0) throw InputError("--max-elements: must be above zero");
    if (elements) limit_elements(static_cast<std::size_t>(*elements));
    if (timeout.empty()) return;
    double seconds = 0;
    try {
      seconds = parse_quantity(timeout, Dimension::time);
    } catch (const InputError& error) {
      throw InputError("--timeout", error.what());
    }
    if (!(seconds > 0)) throw InputError("--timeout: must be above zero");
    stop.emplace(seconds, "--timeout", LimitOf::command);
  }
};

Option Option::type_name(const std::string& name) const {
  return Option(option_->type_name(name));
}
Option Option::required() const {
  return Option(option_->required());
}
Option Option::excludes(const Option& other) const {
  return Option(option_->excludes(other.option_));
}
Option Option::default_text(const std::string& text) const {
  return Option(option_->default_str(text));
}
Option Option::show_default() const {
  return Option(option_->capture_default_str());
}
Option Option::one_value_each() const {
  return Option(option_->allow_extra_args(false));
}
Option Option::value_may_be_left_out() const {
  return Option(option_->expected(0, 1));
}
Option Option::not_negative() const {
  return Option(option_->check(CLI::NonNegativeNumber));
}
Option Option::one_of(const std::vector<std::string>& words) const {
  return Option(option_->check(CLI::IsMember(words)));
}
Option Option::check(const std::function<std::string(const std::string&)>& wrong) const {
  return Option(option_->check(wrong));
}

CommandLine::CommandLine(const std::string& what, const std::string& name)
    : app_(std::make_unique<CLI::App>(what, name)), limits_(std::make_unique<Limits>()) {}
CommandLine::~CommandLine() = default;

template <class T>
Option CommandLine::add_option(const std::string& names, T& to, const std::string& what) {
  return Option(app_->add_option(names, to, what));
}

Option CommandLine::add_flag(const std::string& names, bool& to, const std::string& what) {
  return Option(app_->add_flag(names, to, what));
}

bool CommandLine::has(const std::string& name) const {
  return app_->count(name) > 0;
}

bool parse_arguments(CommandLine& line, int argc, char** argv) {
  CLI::App& app = *line.app_;
  if (app.get_option_no_throw("--version") == nullptr) {
    const std::string name = app.get_name().empty() ? stem(argv[0]) : app.get_name();
    app.set_version_flag("--version", name + " " + version(), "Print the version and exit");
  }
  if (app.get_option_no_throw("--timeout") == nullptr) line.limits_->declare(app);
  if (argc == 2 && std::string_view(argv[1]) == kDescribe) {
    if (app.get_name().empty()) app.name(stem(argv[0]));
    print_to_stdout(described(app));
    return false;
  }
  refuse_empty_values(argc, argv);
  try {
    app.parse(argc, argv);
    line.limits_->begin();
    return true;
  } catch (const CLI::CallForHelp&) {
    print_to_stdout(without_false(app.help()));
  } catch (const CLI::CallForAllHelp&) {
    print_to_stdout(app.help("", CLI::AppFormatMode::All));
  } catch (const CLI::CallForVersion& version_text) {
    print_to_stdout(std::string(version_text.what()) + "\n");
  } catch (const CLI::ExtrasError&) {
    refuse_extras(app, app.remaining(true));
  } catch (const CLI::ParseError& error) {
    throw InputError(fmt::format("{}; --help shows what is accepted", one_line(error.what())));
  }
  return false;
}

bool is_number(const std::string& text, double& number) {
  return CLI::detail::lexical_cast(text, number);
}

void add_threads_option(CommandLine& app, int& threads) {
  // Each takes memory of its own, used or not.
  static constexpr int kMost = 1024;
  app.add_option("--threads", threads, "Threads; 0 is every core").check([](const std::string& text) {
    int number = 0;
    return CLI::detail::lexical_cast(text, number) && number >= 0 && number <= kMost
               ? std::string()
               : fmt::format("\"{}\" is no whole number from 0 to {}", text, kMost);
  });
}

template Option CommandLine::add_option(const std::string&, std::string&, const std::string&);
template Option CommandLine::add_option(const std::string&, std::vector<std::string>&, const std::string&);
template Option CommandLine::add_option(const std::string&, std::optional<std::string>&, const std::string&);
template Option CommandLine::add_option(const std::string&, int&, const std::string&);
template Option CommandLine::add_option(const std::string&, double&, const std::string&);
template Option CommandLine::add_option(const std::string&, std::optional<double>&, const std::string&);
template Option CommandLine::add_option(const std::string&, std::optional<long long>&, const std::string&);
template Option CommandLine::add_option(const std::string&, std::optional<std::size_t>&, const std::string&);

}  // namespace flexel
