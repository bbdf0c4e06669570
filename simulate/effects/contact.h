// Contact: parts that touch push each other apart, slide and stick (docs/reference/contact.md). simulate/contact has
// the mechanics; here are the keys and the hooks. Forces along the normals have a potential; friction and
// damping and what sticks are an effect of their own that shares the contacts.
#pragma once
#include <map>

#include "simulate/contact/pairs/settings.h"
#include "simulate/effects/effect.h"

namespace flexel::simulate {

class Contacts;  // simulate/contact/contacts.h

// Friction, damping and sticking of the contacts of a run.
class ContactLosses : public Effect {
 public:
  static constexpr const char* name = "contact friction";

  explicit ContactLosses(std::shared_ptr<Contacts> contacts) : contacts_(std::move(contacts)) {}
  [[nodiscard]] std::string why() const override { return "friction, damping and sticking of [contact]"; }
  [[nodiscard]] EnergyAccount account() const override { return EnergyAccount::dissipation; }
  [[nodiscard]] bool finishes_steps() const override { return true; }
  [[nodiscard]] bool adds_stiffness() const override { return true; }
  // Within an implicit step, of which it is a part (simulate/contact/implicit_contact.h).
  [[nodiscard]] double energy(const State& state) override;
  [[nodiscard]] bool acts(const State& state) override;
  void add_forces(const State& state, std::vector<Vec3>& forces) override;
  void add_stiffness(const State& state, BlockMatrix& matrix) override;
  [[nodiscard]] bool tells_where_it_pulls() const override { return true; }  // nowhere that Contact does not
  void finish_step(State& state, const StepDone& done) override;

 private:
  std::shared_ptr<Contacts> contacts_;
};

class Contact : public Effect {
 public:
  struct Parameters {
    bool on = false;
    std::optional<std::vector<std::string>> parts;  // names; nothing: all
    bool self = true;
    double stiffness = 1;
    double friction = 0;
    bool friction_of_materials = false;              // where a scene's material gives none, the library's
    double stick = 0;                                // Pa, of materials that give none
    std::map<std::string, double> sticky;            // Pa, by material
    double damping = 0;                              // s
    double parting = 0;                              // s, of overlap = "part"; 0: refused
    std::vector<std::array<std::string, 2>> bonded;  // parts of [[bond]]
    std::vector<std::string> glued;                  // parts of [[manipulator]] with glue
    std::vector<ContactPlane> planes;
    std::string origin;

    // Something of the scene sticks to something.
    [[nodiscard]] bool sticks() const;
  };
  static constexpr const char* name = "contact";

  static void parse(TableReader& scene, Parameters& parameters);
  [[nodiscard]] static std::optional<Contact> make(const Parameters& parameters, const Problem& problem);
  [[nodiscard]] std::string why() const override;
  // Parts that fit each other too nearly for their force to be known.
  [[nodiscard]] std::vector<std::string> warnings(const State& state) const override;

  [[nodiscard]] EnergyAccount account() const override { return EnergyAccount::stored; }
  [[nodiscard]] bool adds_stiffness() const override { return true; }
  [[nodiscard]] std::vector<CoupledElements> couples() const override;
  [[nodiscard]] double energy(const State& state) override;
  [[nodiscard]] bool acts(const State& state) override;
  void add_forces(const State& state, std::vector<Vec3>& forces) override;
  void add_stiffness(const State& state, BlockMatrix& matrix) override;
  void add_positive_stiffness(const State& state, BlockMatrix& matrix) override;
  [[nodiscard]] std::vector<std::uint32_t> may_pull_at() const override;
  [[nodiscard]] bool tells_where_it_pulls() const override { return true; }
  [[nodiscard]] double added_frequency(const State& state, const std::vector<double>& mass) override;
  [[nodiscard]] bool needs_step_recheck(const State& state) override;
  // Needs no finishes_steps(): what it remembers does not mind that the last velocities are of a whole step.
  void finish_step(State& state, const StepDone& done) override;
  [[nodiscard]] std::string refuses_implicit_steps() const override;
  [[nodiscard]] StepBearing begin_implicit_step(const State& before, const State& aimed,
                                                double step) override;
  [[nodiscard]] bool settles(const State& found) override;
  void end_implicit_step(const State& state, const StepDone& done,
                         const std::vector<Vec3>& supports) override;
  void add_touches(const State& state, double ahead, std::vector<PartTouch>& touches) override;
  [[nodiscard]] std::vector<double> memory() const override;
  void restore(const std::vector<double>& memory) override;
  [[nodiscard]] std::vector<double> transfer_state() const override;
  void restore_from(const std::vector<double>& transfer_state) override;
  [[nodiscard]] std::vector<std::string> history_columns() const override;
  [[nodiscard]] std::vector<double> history_values(const State& state, const std::vector<Vec3>&) override;
  [[nodiscard]] std::vector<EnergyTransfer> take_transfers(const State& state) override;
  // Nothing where nothing is lost.
  [[nodiscard]] std::optional<ContactLosses> losses() const;

 private:
  std::shared_ptr<Contacts> contacts_;
  std::vector<std::string> names_;  // (parts)
};

// Whether the scene asks for contact: `contact = true`, [contact] or [[plane]]. Touching parts are not bonded
// then.
[[nodiscard]] bool asks_for_contact(TableReader& scene);

}  // namespace flexel::simulate
