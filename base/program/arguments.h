// Arguments of a program. CLI11 reads them, and only arguments.cpp sees it: in this header it would be
// compiled with every command.
#pragma once
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace flexel {

// An option that was declared, and what more can be said of it.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}
  Option type_name(const std::string& name) const;
  Option required() const;
  Option excludes(const Option& other) const;
  Option default_text(const std::string& text) const;
  Option show_default() const;    // the value that its variable has now
  Option one_value_each() const;  // of a list: --push A --push B, not --push A B
  Option value_may_be_left_out() const;
  Option not_negative() const;
  Option one_of(const std::vector<std::string>& words) const;
  // What is wrong with a value, or nothing.
  Option check(const std::function<std::string(const std::string&)>& wrong) const;

 private:
  CLI::Option* option_;
};

// What a program or command can be told. Every one has --timeout, --max-memory and --max-elements, which hold from
// parse_arguments() on, while this lives.
class CommandLine {
 public:
  explicit CommandLine(const std::string& what, const std::string& name = "");
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  // "-o,--output", or without dashes by its place. A type of variable that no option had yet goes into the
  // list at the end of arguments.cpp.
  template <class T>
  Option add_option(const std::string& names, T& to, const std::string& what = "");
  // "!--no-x" makes `to` false.
  Option add_flag(const std::string& names, bool& to, const std::string& what);
  // Whether it was given, once the arguments are parsed.
  [[nodiscard]] bool has(const std::string& name) const;

 private:
  friend bool parse_arguments(CommandLine& line, int argc, char** argv);
  struct Limits;
  std::unique_ptr<CLI::App> app_;
  std::unique_ptr<Limits> limits_;
};

// Parses the arguments. --help and --version print and yield their exit code (0); a wrong argument throws
// InputError with the nearest valid option where one is near. --describe-arguments alone prints them for the makers of
// man pages and completions. Returns true when the program should go on,
// false when it is done (help or version was printed).
[[nodiscard]] bool parse_arguments(CommandLine& line, int argc, char** argv);

// Whether `text` is a number ("nan" too), and which.
[[nodiscard]] bool is_number(const std::string& text, double& number);

// --threads: how many the work may use; 0 is every core.
void add_threads_option(CommandLine& app, int& threads);

}  // namespace flexel
