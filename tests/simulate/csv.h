// Reads a history (--history) back.
#pragma once
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace flexel::simulate::testing {

struct Csv {
  std::vector<std::string> names;  // without units
  std::vector<std::vector<double>> columns;
  [[nodiscard]] const std::vector<double>& column(const std::string& name) const {
    for (std::size_t i = 0; i < names.size(); ++i)
      if (names[i] == name) return columns[i];
    throw std::runtime_error("the history has no column \"" + name + "\"");
  }
};

inline Csv read_csv(const std::string& path) {
  Csv csv;
  std::ifstream file(path);
  std::string line, item;
  std::getline(file, line);
  std::istringstream header(line);
  while (std::getline(header, item, ',')) csv.names.push_back(item.substr(0, item.find(" [")));
  csv.columns.resize(csv.names.size());
  while (std::getline(file, line)) {
    std::istringstream row(line);
    for (std::size_t i = 0; std::getline(row, item, ','); ++i) csv.columns.at(i).push_back(std::stod(item));
  }
  return csv;
}

}  // namespace flexel::simulate::testing
