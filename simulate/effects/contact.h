// Contact: parts that touch push each other apart, slide and stick (docs/reference/contact.md). simulate/contact has
// the mechanics; here are the keys and the hooks. Forces along the normals have a potential; friction and
// damping and what sticks are an effect of their own that shares the contacts.
#pragma once
#include <map>

#include "simulate/contact/settings.h"
#include "simulate/effects/effect.h"

namespace flexel::simulate {

class Contacts;  // simulate/contact/contacts.h

// Friction, damping and sticking of the contacts of a run.
class ContactLosses {
 public:
  static constexpr const char* name = "contact friction";
  static constexpr bool needs_time = true;
  static constexpr Book book = Book::dissipation;

  explicit ContactLosses(std::shared_ptr<Contacts> contacts) : contacts_(std::move(contacts)) {}
  [[nodiscard]] std::string why() const { return "friction, damping and sticking of [contact]"; }
  void add_forces(const State& state, std::vector<Vec3>& forces) const;
  void finish_step(State& state, const StepDone& done) const;

 private:
  std::shared_ptr<Contacts> contacts_;
};

class Contact {
 public:
  struct Parameters {
    bool on = false;
    std::optional<std::vector<std::string>> parts;  // names; nothing: all
    bool self = true;
    double stiffness = 1;
    double friction = 0;
    double stick = 0;                                // Pa, of materials that give none
    std::map<std::string, double> sticky;            // Pa, by material
    double damping = 0;                              // s
    double parting = 0;                              // s, of overlap = "part"; 0: refused
    std::vector<std::array<std::string, 2>> bonded;  // parts of [[bond]]
    std::vector<std::string> glued;                  // parts of [[manipulator]] with glue
    std::vector<ContactPlane> planes;
    std::string origin;
  };
  static constexpr const char* name = "contact";
  static constexpr bool needs_time = true;
  static constexpr Book book = Book::stored;

  static void parse(TableReader& scene, Parameters& parameters);
  [[nodiscard]] static std::optional<Contact> make(const Parameters& parameters, const Problem& problem);
  [[nodiscard]] std::string why() const;

  [[nodiscard]] double energy(const State& state) const;
  void add_forces(const State& state, std::vector<Vec3>& forces) const;
  [[nodiscard]] double added_frequency(const State& state, const std::vector<double>& mass) const;
  [[nodiscard]] bool needs_step_recheck(const State& state) const;
  [[nodiscard]] std::vector<double> memory() const;
  void restore(const std::vector<double>& memory) const;
  [[nodiscard]] std::vector<double> transfer_state() const;
  void restore_from(const std::vector<double>& transfer_state) const;
  [[nodiscard]] std::vector<std::string> history_columns() const;
  [[nodiscard]] std::vector<double> history_values(const State& state, const std::vector<Vec3>&) const;
  static constexpr const char* injected_by = "overlap";
  [[nodiscard]] double injected_energy(const State& state) const;
  [[nodiscard]] std::optional<ContactLosses> companion() const;

 private:
  std::shared_ptr<Contacts> contacts_;
  std::vector<std::string> names_;  // (parts)
};

// Whether the scene asks for contact: `contact = true`, [contact] or [[plane]]. Touching parts are not bonded
// then.
[[nodiscard]] bool asks_for_contact(TableReader& scene);

}  // namespace flexel::simulate
