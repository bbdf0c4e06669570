// Conclusions from the rows of a study: references, errors, sums, sentences.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "flexel/study/conclude.h"
#include "flexel/study/study.h"

namespace flexel::study {
namespace {

constexpr double kStill = 1e-3;  // a probe that moves less than this share of the most does not decide

// Probes (of timed runs: the most that they moved), or the largest displacement where there are none.
bool may_decide(const Study& study, const std::string& name) {
  const std::vector<std::string>& probes = study.facts.probes;
  const std::string ending = study.facts.timed ? " peak" : "";
  const bool probe =
      std::any_of(probes.begin(), probes.end(), [&](const std::string& p) { return name == p + ending; });
  return probe || (probes.empty() && name == "largest displacement");
}

std::vector<Reference> references_of(const Study& study, const std::vector<Reference>& given) {
  std::vector<Reference> result;
  const std::vector<const Row*> rows = sizes_of(study, "resolution");
  if (rows.empty()) return result;
  double most = 0;
  for (const Quantity& quantity : rows.back()->found.quantities) {
    Reference reference = extrapolate(quantity.name, quantity.unit, values_of(rows, quantity.name));
    for (const Reference& each : given)
      if (each.name == quantity.name) reference = each;
    reference.decides = may_decide(study, quantity.name);
    if (quantity.unit == "m") most = std::max(most, std::abs(reference.value));
    result.push_back(reference);
  }
  for (Reference& each : result)
    if (each.unit == "m" && std::abs(each.value) < kStill * most) each.decides = false;
  return result;
}

// "--size 1.5mm --method affine"; what belongs into the scene in words behind it.
std::string options_of(const Trial& trial) {
  const Configuration& c = trial.configuration;
  if (trial.sweep == "calculix") return "tetrahedra with edges of " + option_length(c.size);
  std::string text = "--size " + option_length(c.size);
  if (trial.sweep == "mapping") text += " --method " + c.method;
  if (trial.sweep == "threads") text += " --threads " + std::to_string(c.threads);
  if (trial.sweep == "model") {
    text += c.model == "paper" ? " --placement centre" : " --align none";
    text += " and model = \"" + c.model + "\"";
    if (!c.hooke.empty()) text += ", hooke = \"" + c.hooke + "\"";
    text += " in the scene";
  }
  if (c.tolerance) text += fmt::format(" and tolerance = {:g} in the scene", *c.tolerance);
  if (!c.integrator.empty()) text += fmt::format(" and method = \"{}\" in the scene", c.integrator);
  if (c.step) text += fmt::format(" and step = \"{:.3g} s\" in the scene", *c.step);
  return text;
}

std::vector<Summed> sum_up(const Study& study) {
  std::vector<Summed> result;
  std::map<std::string, std::size_t> seen;
  std::vector<std::vector<double>> walls;
  for (std::size_t r = 0; r < study.rows.size(); ++r) {
    const Row& row = study.rows[r];
    if (!row.found.ok()) continue;
    const auto [found, is_new] = seen.try_emplace(row.trial.label, result.size());
    if (is_new) {
      Summed each;
      each.row = r;
      each.point.label = row.trial.label;
      each.point.sweep = row.trial.sweep;
      each.point.options = options_of(row.trial);
      each.point.error = row.error;
      each.point.choosable = row.trial.sweep != "effect" && row.trial.sweep != "calculix";
      result.push_back(each);
      walls.emplace_back();
    }
    Summed& each = result[found->second];
    ++each.runs;
    each.point.memory = std::max(each.point.memory, row.found.memory);
    walls[found->second].push_back(row.found.wall);
  }
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i].wall = median(walls[i]);
    result[i].point.seconds = result[i].wall.value;
  }
  return result;
}

std::string range(const Reference& reference) {
  return fmt::format("{:.5g} +- {:.2g} {}", reference.value, reference.uncertainty, reference.unit);
}

// What CalculiX found beside our references; what counts and does not agree is said at the top of the page.
void conclude_against(Study& study) {
  const std::vector<const Row*> rows = sizes_of(study, "calculix");
  if (rows.empty()) return;
  for (const Reference& ours : study.references) {
    const std::vector<SizeValue> values = values_of(rows, ours.name);
    if (values.empty()) continue;
    const Agreement found = compare(ours, values);
    study.against.agreements.push_back(found);
    if (ours.decides && !found.agree)
      study.notes.push_back(fmt::format(
          "CalculiX and Flexel differ in \"{}\" by more than both uncertainties: {} from {} sizes, "
          "and {}. Which of the two is nearer this study does not tell.",
          ours.name, range(found.theirs), values.size(), range(ours)));
  }
}

}  // namespace

std::vector<const Row*> sizes_of(const Study& study, const std::string& sweep) {
  std::vector<const Row*> rows;
  for (const Row& row : study.rows)
    if (row.trial.sweep == sweep && row.found.ok() && row.repeat == 1) rows.push_back(&row);
  std::stable_sort(rows.begin(), rows.end(),
                   [](const Row* a, const Row* b) { return a->found.spacing > b->found.spacing; });
  return rows;
}

std::vector<SizeValue> values_of(const std::vector<const Row*>& rows, const std::string& quantity) {
  std::vector<SizeValue> values;
  for (const Row* row : rows)
    if (const Quantity* found = row->found.find(quantity))
      values.push_back({row->found.spacing, found->value, row->found.thin_matter <= kThinMatter});
  return values;
}

void conclude(Study& study, const std::vector<Reference>& given) {
  study.references = references_of(study, given);
  for (Row& row : study.rows)
    if (row.found.ok()) row.error = error_of(row.found, study.references);
  study.summed = sum_up(study);
  std::vector<Point> points;
  for (const Summed& each : study.summed) points.push_back(each.point);
  study.sentences = doubtful_sentences(study.references);
  if (study.sentences.empty()) study.sentences = sentences(points);
  if (const std::string sentence = against_sentence(points); !sentence.empty())
    study.sentences.push_back(sentence);
  conclude_against(study);
}

}  // namespace flexel::study
