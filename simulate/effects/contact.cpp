// [contact] and [[plane]] of a scene.
#include "simulate/effects/contact.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "base/error.h"
#include "simulate/contact/contacts.h"
#include "simulate/input/part_names.h"

namespace flexel::simulate {
namespace {

bool flag(TableReader& reader, const char* key, bool fallback) {
  const SceneValue* value = reader.find(key);
  if (!value) return fallback;
  if (value->kind != SceneValue::Kind::boolean)
    reader.fail(value->line, fmt::format("\"{}\" needs to be true or false", key));
  return value->flag;
}

double at_least_0(TableReader& reader, const char* key, double fallback) {
  const double value = reader.number(key).value_or(fallback);
  if (!(value >= 0)) reader.fail(reader.find(key)->line, fmt::format("\"{}\" needs to be 0 or more", key));
  return value;
}

double parse_stick(TableReader& reader) {
  const double stick = reader.quantity("stick", Dimension::pressure).value_or(0);
  if (!(stick >= 0)) reader.fail(reader.find("stick")->line, "\"stick\" needs to be 0 or more");
  return stick;
}

// `overlap` and `overlap_time`: s, or 0 where what overlaps at the start is refused.
double parse_parting(TableReader& reader) {
  const std::string how = reader.text("overlap").value_or("refuse");
  const std::optional<double> time = reader.quantity("overlap_time", Dimension::time);
  if (how != "refuse" && how != "part")
    reader.fail(reader.find("overlap")->line, "\"overlap\" needs to be \"refuse\" or \"part\"");
  if (how == "refuse" && time)
    reader.fail(reader.find("overlap_time")->line, "\"overlap_time\" needs \"overlap\" = \"part\"");
  if (how == "refuse") return 0;
  if (!time || !(*time > 0))
    reader.fail(
        reader.find("overlap")->line,
        "\"overlap\" = \"part\" needs \"overlap_time\" above 0, for example \"20 ms\": the time in which "
        "they are let out");
  return *time;
}

// `stick` of [materials.NAME].
std::map<std::string, double> sticky_materials(TableReader& scene) {
  std::map<std::string, double> sticky;
  const SceneValue* materials = scene.find("materials");
  if (!materials) return sticky;
  for (const auto& [name, value] : materials->members) {
    if (value.kind != SceneValue::Kind::table) continue;
    TableReader reader(value, scene.file(), fmt::format("[materials.{}]", name));
    if (reader.find("stick")) sticky[name] = parse_stick(reader);
  }
  return sticky;
}

double stick_of(const Contact::Parameters& parameters, const Body& body, std::uint32_t part,
                const Material& material) {
  for (const std::string& glued : parameters.glued)
    if (require_part(body, glued, "[[manipulator]]") == part) return std::numeric_limits<double>::infinity();
  const auto own = parameters.sticky.find(material.name);
  return own == parameters.sticky.end() ? parameters.stick : own->second;
}

// `glue = true` of [[manipulator]], which simulate/effects/rigid.cpp reads.
std::vector<std::string> glued_parts(TableReader& scene) {
  std::vector<std::string> glued;
  for (const SceneValue* table : scene.tables("manipulator")) {
    TableReader reader(*table, scene.file(), "[[manipulator]]");
    if (flag(reader, "glue", false)) glued.push_back(reader.text("part").value_or(""));
  }
  return glued;
}

// `parts` of [[bond]], which simulate/effects/bonds.cpp reads.
std::vector<std::array<std::string, 2>> bonded_parts(TableReader& scene) {
  std::vector<std::array<std::string, 2>> bonded;
  if (const SceneValue* bond = scene.find("bond"); !bond || bond->kind == SceneValue::Kind::boolean)
    return {};
  for (const SceneValue* table : scene.tables("bond")) {
    TableReader reader(*table, scene.file(), "[[bond]]");
    const SceneValue& parts = reader.require("parts", "[\"a\", \"b\"]");
    bonded.push_back({parts.items.at(0).text, parts.items.at(1).text});
  }
  return bonded;
}

std::optional<std::vector<std::string>> parse_names(TableReader& reader) {
  const SceneValue* value = reader.find("parts");
  if (!value) return std::nullopt;
  if (value->kind == SceneValue::Kind::string && value->text == "all") return std::nullopt;
  std::vector<std::string> names;
  bool sound = value->kind == SceneValue::Kind::array;
  for (const SceneValue& item : value->items) {
    sound = sound && item.kind == SceneValue::Kind::string;
    names.push_back(item.text);
  }
  if (!sound || names.empty())
    reader.fail(value->line,
                "\"parts\" needs to be \"all\" or a list of names, for example [\"peg\", \"hole\"]");
  return names;
}

ContactPlane parse_plane(TableReader& reader, std::size_t number) {
  ContactPlane plane;
  plane.origin = reader.place();
  plane.name = reader.text("name").value_or(fmt::format("plane {}", number));
  plane.point = reader.to_vector(reader.require("point", "[\"0 mm\", \"0 mm\", \"-5 mm\"]"),
                                 Dimension::length, "point");
  (void)reader.require("normal", "[0, 0, 1]");
  plane.normal = *reader.direction("normal");
  if (reader.find("friction")) plane.friction = at_least_0(reader, "friction", 0);
  if (reader.find("stick")) plane.stick = parse_stick(reader);
  reader.finish();
  return plane;
}

// With the friction of the library's materials as that of the scene's. Throws InputError: one that touches has none.
Problem with_library_friction(const Contact::Parameters& parameters, const std::vector<std::uint8_t>& touches,
                              Problem problem) {
  for (std::size_t p = 0; p < problem.materials.size(); ++p) {
    Material& material = problem.materials[p];
    if (!touches[p] || material.contact_friction) continue;
    if (!(material.friction > 0))
      throw InputError(
          parameters.origin,
          fmt::format("\"friction\" = \"material\": {} of part \"{}\" has none: write friction = 0.3 in "
                      "[materials.NAME], or a number here",
                      material.name, problem.body.parts[p].name));
    material.contact_friction = material.friction;
  }
  return problem;
}

std::vector<std::uint8_t> chosen_parts(const Contact::Parameters& parameters, const Body& body) {
  if (!parameters.parts) return std::vector<std::uint8_t>(body.parts.size(), 1);
  std::vector<std::uint8_t> chosen(body.parts.size(), 0);
  for (const std::string& name : *parameters.parts)
    for (const std::uint32_t p : require_parts(body, name, parameters.origin)) chosen[p] = 1;
  return chosen;
}

}  // namespace

bool asks_for_contact(TableReader& scene) {
  const SceneValue* contact = scene.find("contact");
  const bool said = contact && contact->kind == SceneValue::Kind::boolean;
  return said ? contact->flag : contact || scene.find("plane");
}

void Contact::parse(TableReader& scene, Parameters& parameters) {
  for (const SceneValue* table : scene.tables("plane")) {
    TableReader reader(*table, scene.file(), "[[plane]]");
    parameters.planes.push_back(parse_plane(reader, parameters.planes.size() + 1));
  }
  parameters.on = asks_for_contact(scene);
  parameters.glued = glued_parts(scene);
  parameters.sticky = sticky_materials(scene);
  parameters.bonded = bonded_parts(scene);
  if (!parameters.on && !parameters.glued.empty())
    scene.fail("\"glue\" of a [[manipulator]] needs \"contact\" = true: what touches it stays");
  const SceneValue* contact = scene.find("contact");
  if (contact && !parameters.on && !parameters.planes.empty())
    scene.fail(contact->line, "\"contact\" = false, but there is a [[plane]], which only contact feels");
  if (!contact || contact->kind == SceneValue::Kind::boolean) return;
  TableReader reader(*contact, scene.file(), "[contact]");
  parameters.origin = reader.place();
  parameters.parts = parse_names(reader);
  parameters.self = flag(reader, "self", true);
  parameters.stiffness = at_least_0(reader, "stiffness", 1);
  if (!(parameters.stiffness > 0)) reader.fail("\"stiffness\" in [contact] needs to be above 0");
  const SceneValue* friction = reader.find("friction");
  parameters.friction_of_materials =
      friction && friction->kind == SceneValue::Kind::string && friction->text == "material";
  if (!parameters.friction_of_materials) parameters.friction = at_least_0(reader, "friction", 0);
  parameters.stick = parse_stick(reader);
  parameters.damping = reader.quantity("damping", Dimension::time).value_or(0);
  if (!(parameters.damping >= 0)) reader.fail("\"damping\" in [contact] needs to be 0 or more");
  parameters.parting = parse_parting(reader);
  reader.finish();
}

bool Contact::Parameters::sticks() const {
  return stick > 0 || !glued.empty() ||
         std::any_of(sticky.begin(), sticky.end(), [](const auto& each) { return each.second > 0; }) ||
         std::any_of(planes.begin(), planes.end(),
                     [](const ContactPlane& plane) { return plane.stick.value_or(0) > 0; });
}

std::optional<Contact> Contact::make(const Parameters& parameters, const Problem& problem) {
  if (!parameters.on) return std::nullopt;
  ContactSettings settings;
  settings.parts = chosen_parts(parameters, problem.body);
  settings.self = parameters.self;
  settings.stiffness = parameters.stiffness;
  settings.friction = parameters.friction;
  settings.damping = parameters.damping;
  settings.release_time = parameters.parting;
  for (const std::array<std::string, 2>& each : parameters.bonded) {
    std::array<std::uint32_t, 2> parts{};
    for (std::size_t side = 0; side < 2; ++side)
      parts[side] = require_part(problem.body, each[side], "[[bond]]");
    std::sort(parts.begin(), parts.end());
    settings.bonded.push_back(parts);
  }
  for (std::uint32_t p = 0; p < problem.body.parts.size(); ++p)
    settings.stick.push_back(stick_of(parameters, problem.body, p, problem.materials[p]));
  settings.planes = parameters.planes;
  Contact made;
  const std::vector<std::uint8_t> touches = settings.parts;
  made.contacts_ = std::make_shared<Contacts>(
      std::move(settings),
      parameters.friction_of_materials ? with_library_friction(parameters, touches, problem) : problem);
  for (const Part& part : problem.body.parts) made.names_.push_back(part.name);
  return made;
}

std::string Contact::why() const {
  return fmt::format("[contact], {} points", contacts_->points().size());
}

std::vector<std::string> Contact::warnings(const State&) const {
  const std::vector<UnsureFit>& fits = contacts_->unsure_fits();
  if (fits.empty()) return {};
  const UnsureFit& worst = *std::max_element(fits.begin(), fits.end(), [](const auto& a, const auto& b) {
    return a.misfit / a.width < b.misfit / b.width;
  });
  const std::string others =
      fits.size() > 1 ? fmt::format(", and {} other pair(s) of parts", human_count(fits.size() - 1)) : "";
  return {fmt::format(
      "[contact] curved surfaces of parts \"{}\" and \"{}\"{} fit each other to {} ({:.2g} cells), too "
      "little to "
      "be told from their facets: an interference or an offset so small may press with half of its force, "
      "with twice that or not at all; smaller cells and finer facets tell",
      names_[worst.parts[0]], names_[worst.parts[1]], others, human_length(worst.misfit),
      worst.misfit / worst.width)};
}

double Contact::energy(const State& state) {
  return contacts_->energy(state);
}

bool Contact::acts(const State& state) {
  return contacts_->act(state);
}

void Contact::add_forces(const State& state, std::vector<Vec3>& forces) {
  contacts_->add_forces(state, forces);
}

double Contact::added_frequency(const State& state, const std::vector<double>&) {
  if (state.time) contacts_->refuse_overlap(state);
  return contacts_->frequency(state);
}

bool Contact::needs_step_recheck(const State& state) {
  return contacts_->needs_step_recheck(state);
}

void Contact::add_touches(const State& state, double ahead, std::vector<PartTouch>& touches) {
  contacts_->add_touches(state, ahead, touches);
}

std::vector<double> Contact::memory() const {
  return contacts_->memory();
}

void Contact::restore(const std::vector<double>& memory) {
  contacts_->restore(memory);
}

std::vector<double> Contact::transfer_state() const {
  return contacts_->transfer_state();
}

void Contact::restore_from(const std::vector<double>& transfer_state) {
  contacts_->restore_from(transfer_state);
}

// Of the free rigid parts; what leads a manipulator tells its own.
std::vector<std::string> Contact::history_columns() const {
  std::vector<std::string> columns;
  for (const RigidLoad& load : contacts_->rigid_loads())
    for (const char* what : {"force", "torque"})
      for (const char axis : {'x', 'y', 'z'})
        columns.push_back(fmt::format("{} contact {} {} [{}]", names_[load.part], what, axis,
                                      std::string(what) == "force" ? "N" : "N m"));
  return columns;
}

std::vector<double> Contact::history_values(const State& state, const std::vector<Vec3>&) {
  std::vector<double> values;
  for (const RigidLoad& load : contacts_->rigid_loads_about_centres(state)) {
    values.insert(values.end(), load.force.begin(), load.force.end());
    values.insert(values.end(), load.torque.begin(), load.torque.end());
  }
  return values;
}

std::vector<EnergyTransfer> Contact::take_transfers(const State& state) {
  const auto [released, hardened, numerical] = contacts_->take_energies(state);
  return {{"overlap", EnergyAccount::work, released},
          {"contact hardening", EnergyAccount::dissipation, -hardened},
          {"numerical", EnergyAccount::dissipation, -numerical}};
}

std::optional<ContactLosses> Contact::losses() const {
  if (!contacts_->dissipate()) return std::nullopt;
  return ContactLosses(contacts_);
}

bool ContactLosses::acts(const State& state) {
  return contacts_->act(state);
}

void ContactLosses::add_forces(const State& state, std::vector<Vec3>& forces) {
  contacts_->add_dissipative_forces(state, forces);
}

double ContactLosses::energy(const State& state) {
  return contacts_->friction_potential(state);
}

void ContactLosses::add_stiffness(const State& state, BlockMatrix& matrix) {
  contacts_->add_friction_stiffness(state, matrix);
}

void Contact::add_stiffness(const State& state, BlockMatrix& matrix) {
  contacts_->add_normal_stiffness(state, ContactTangent::whole, matrix);
}

void Contact::add_positive_stiffness(const State& state, BlockMatrix& matrix) {
  contacts_->add_normal_stiffness(state, ContactTangent::positive, matrix);
}

std::vector<std::uint32_t> Contact::may_pull_at() const {
  return contacts_->carrying_elements();
}

std::vector<CoupledElements> Contact::couples() const {
  return contacts_->couples();
}

std::string Contact::refuses_implicit_steps() const {
  return contacts_->refuses_implicit_steps();
}

StepBearing Contact::begin_implicit_step(const State& before, const State& aimed, double step) {
  return {contacts_->begin_implicit_step(before, aimed, step), contacts_->take_recoupled()};
}

bool Contact::settles(const State& found) {
  return contacts_->settles(found);
}

void Contact::end_implicit_step(const State& state, const StepDone&, const std::vector<Vec3>&) {
  contacts_->end_implicit_step(state);
}

void Contact::finish_step(State& state, const StepDone& done) {
  contacts_->finish_step(state, done.drift);
}

void ContactLosses::finish_step(State& state, const StepDone& done) {
  contacts_->finish_losses(state, done.drift);
}

}  // namespace flexel::simulate
