// LAMMPS evaluates the courses of loads and moves as variables of its step number, as Flexel takes them at
// its own.
#include "flexel/lammps/input_files.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>

#include "base/files/append_text.h"
#include "base/files/output_file.h"
#include "base/printable.h"
#include "base/stop.h"
#include "flexel/lammps/dashpots.h"

namespace flexel::lammps {
namespace {

constexpr std::size_t kPiece = std::size_t{1} << 20;  // bytes that are written at a time
constexpr const char* kAxes = "xyz";

// FNV-1a.
std::uint64_t hashed(std::uint64_t hash, const std::string& text) {
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  return hash;
}

// Text that goes to the file as it grows.
class DataText {
 public:
  explicit DataText(const std::string& path) : file_(path, false) {}
  template <class... T>
  void add(fmt::format_string<T...> format, T&&... values) {
    append_text(text_, format, std::forward<T>(values)...);
    if (text_.size() < kPiece) return;
    check_stop();
    flush();
  }
  // Returns a hash of the text.
  std::uint64_t commit() {
    flush();
    file_.commit();
    return hash_;
  }

 private:
  void flush() {
    hash_ = hashed(hash_, text_);
    file_.write(text_);
    text_.clear();
  }
  OutputFile file_;
  std::string text_;
  std::uint64_t hash_ = 0xcbf29ce484222325U;
};

bool turns(const Particles& particles) {
  return std::any_of(particles.supports.begin(), particles.supports.end(), [&](const SupportGroup& group) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if ((group.mask >> axis & 1) && particles.motions[group.motion[axis]].angle != 0) return true;
    return false;
  });
}

// What each atom carries beside its mass, in the order of the section "Elements".
std::vector<std::string> properties(const Particles& particles) {
  std::vector<std::string> names;
  for (std::size_t f = 0; f < particles.forces.size(); ++f)
    for (std::size_t axis = 0; axis < 3; ++axis)
      names.push_back(fmt::format("d_force{}{}", f + 1, kAxes[axis]));
  if (turns(particles))
    for (const char* what : {"arm", "back"})
      for (std::size_t axis = 0; axis < 3; ++axis) names.push_back(fmt::format("d_{}{}", what, kAxes[axis]));
  return names;
}

std::array<Turn, 3> turns_of(const Particles& particles, std::size_t e) {
  std::array<Turn, 3> result;
  if (particles.support[e] == 0) return result;
  const SupportGroup& group = particles.supports[particles.support[e] - 1];
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (group.mask >> axis & 1)
      result[axis] = turn_of(particles.motions[group.motion[axis]], particles.led_from[e], axis);
  return result;
}

void write_elements(const Particles& particles, DataText& text) {
  const bool turned = turns(particles);
  text.add("\nElements\n\n");
  for (std::size_t e = 0; e < particles.mass.size(); ++e) {
    text.add("{} {:.17g}", e + 1, particles.mass[e]);
    for (const SteadyForce& each : particles.forces)
      text.add(" {:.17g} {:.17g} {:.17g}", each.force[e].x(), each.force[e].y(), each.force[e].z());
    if (turned) {
      const std::array<Turn, 3> of = turns_of(particles, e);
      text.add(" {:.17g} {:.17g} {:.17g}", of[0].arm, of[1].arm, of[2].arm);
      text.add(" {:.17g} {:.17g} {:.17g}", of[0].back, of[1].back, of[2].back);
    }
    text.add("\n");
  }
}

// Atom types tell what is held or led, and in a second half what loads act on.
std::size_t support_types(const Particles& particles) {
  return particles.supports.size() + 1;
}

bool loaded(const Particles& particles, std::size_t e) {
  return std::any_of(particles.forces.begin(), particles.forces.end(),
                     [&](const SteadyForce& each) { return each.force[e] != Vec3::Zero(); });
}

std::size_t type_of(const Particles& particles, std::size_t e) {
  return 1 + particles.support[e] + (loaded(particles, e) ? support_types(particles) : 0);
}

// The factor of a course at time `t`, a variable: constant before the first time and after the last.
std::string factor(const simulate::TimeCurve& course, const std::string& t) {
  if (course.time.empty()) return "1.0";
  std::string sum = fmt::format("(v_{}<={:.17g})*({:.17g})", t, course.time.front(), course.factor.front());
  for (std::size_t i = 1; i < course.time.size(); ++i) {
    const double from = course.time[i - 1],
                 slope = (course.factor[i] - course.factor[i - 1]) / (course.time[i] - from);
    append_text(sum, "+(v_{}>{:.17g})*(v_{}<={:.17g})*({:.17g}+(v_{}-{:.17g})*({:.17g}))", t, from, t,
                course.time[i], course.factor[i - 1], t, from, slope);
  }
  append_text(sum, "+(v_{}>{:.17g})*({:.17g})", t, course.time.back(), course.factor.back());
  return sum;
}

double factor_at_start(const simulate::TimeCurve& course) {
  simulate::State start;
  start.time = 0;
  return course.at(start);
}

// Text in a comment: three quotes would join the lines behind to it, and LAMMPS warns of characters beyond
// ASCII.
std::string comment(const std::string& text) {
  std::string shown;
  for (const char c : printable(text)) shown += c == '"' || c < ' ' || c > '~' ? '?' : c;
  return shown;
}

// Script that grows line by line.
class Script {
 public:
  Script(const Particles& particles, const BondTypes& types) : particles_(particles), types_(types) {}
  std::string text;

  template <class... T>
  void line(fmt::format_string<T...> format, T&&... values) {
    append_text(text, format, std::forward<T>(values)...);
    text += '\n';
  }

  // There are no pair forces: lists of neighbours are never needed again, and the ghosts of the start are
  // those of the run.
  void settings() {
    double rest = 0;
    for (const Spring& type : types_.types) rest = std::max(rest, type.length);
    const double skin = 0.1 * rest, reach = std::max(1.5 * rest + skin, 1.25 * particles_.longest);
    line("units si\natom_style bond\natom_modify sort 0 0.0\nboundary s s s\nnewton on");
    line("bond_style harmonic\nspecial_bonds lj/coul 1 1 1");
    line("neighbor {:.17g} bin\nneigh_modify every 1000000000 delay 1000000000 check no", skin);
    line("comm_modify cutoff {:.17g}{}", reach, particles_.damped() ? " vel yes" : "");
  }

  void reading(const InputNames& names) {
    const std::vector<std::string> all = properties(particles_);
    line("fix element all property/atom rmass {} ghost yes", fmt::join(all, " "));
    line("read_data \"{}\" fix element NULL Elements\nmass * 1.0  # not used: each atom has its own",
         names.data);
    if (!all.empty()) line("compute element all property/atom {}", fmt::join(all, " "));
    for (std::size_t g = 0; g < particles_.supports.size(); ++g)
      line("group {} type {} {}", group(g), g + 2, g + 2 + support_types(particles_));
    std::string others;
    for (std::size_t g = 0; g < particles_.supports.size(); ++g)
      if (!by_velocity(g)) others += " " + group(g);
    if (others.empty())
      line("group moving union all");
    else
      line("group moving subtract all{}", others);
  }

  void acting() {
    line("variable t equal step*{:.17g}", particles_.step);
    if (const double g = particles_.gravity.norm(); g > 0)
      line("fix gravity all gravity {:.17g} vector {:.17g} {:.17g} {:.17g}", g, particles_.gravity.x(),
           particles_.gravity.y(), particles_.gravity.z());
    if (particles_.forces.empty()) return;
    std::array<std::string, 3> sum;
    for (std::size_t f = 0; f < particles_.forces.size(); ++f) {
      line("variable load{} equal {}", f + 1, factor(particles_.forces[f].course, "t"));
      for (std::size_t axis = 0; axis < 3; ++axis)
        append_text(sum[axis], "{}v_load{}*c_element[{}]", f == 0 ? "" : "+", f + 1, 3 * f + axis + 1);
    }
    for (std::size_t axis = 0; axis < 3; ++axis) line("variable force{} atom {}", kAxes[axis], sum[axis]);
    line("group loaded type {}:{}", support_types(particles_) + 1, 2 * support_types(particles_));
    line("fix loads loaded addforce v_forcex v_forcey v_forcez");
  }

  // Held axes of what moves along the others; after all that adds forces.
  void holding() {
    for (std::size_t g = 0; g < particles_.supports.size(); ++g) {
      const SupportGroup& of = particles_.supports[g];
      if (particles_.leads(of) || of.mask == 7) continue;
      std::string held;
      for (std::size_t axis = 0; axis < 3; ++axis) held += of.mask >> axis & 1 ? " 0.0" : " NULL";
      line("fix {} {} setforce{}", group(g), group(g), held);
    }
  }

  void leading() {
    bool any = false;
    for (const SupportGroup& each : particles_.supports) any = any || particles_.leads(each);
    if (!any) return;
    line("variable before equal v_t-{:.17g}\nvariable still equal 0.0", particles_.step);
    for (std::size_t m = 0; m < particles_.motions.size(); ++m) motion(m);
    for (std::size_t g = 0; g < particles_.supports.size(); ++g)
      if (particles_.leads(particles_.supports[g])) lead(g);
  }

  // Velocity Verlet's first kick is half of a step's; what else Flexel's has.
  void starting() {
    const double step = particles_.step;
    const bool damped = particles_.damped();
    line("fix steps moving nve\ntimestep {:.17g}", step);
    if (damped) {
      std::vector<double> damping;
      for (const Spring& type : types_.types) damping.push_back(type.damping);
      text += dashpot_commands(damping, particles_.half_kick ? 0.5 * step : step);
    }
    if (damped || !particles_.half_kick) line("run 0");
    if (damped) line("python begin invoke");
    if (!particles_.half_kick) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        line("variable kick{} atom v{}+{:.17g}*f{}/mass", kAxes[axis], kAxes[axis], 0.5 * step, kAxes[axis]);
      line("velocity all set v_kickx v_kicky v_kickz units box");
    }
    if (damped || !particles_.half_kick) still();
    if (damped) line("fix damping all python/invoke 1 post_force dashpots");
  }

  void running(const InputNames& names) {
    const auto frames = particles_.frames, steps = particles_.steps;
    line("variable frame equal ceil((floor(step*{}/{})+1)*{}/{})", frames, steps, steps, frames);
    if (!names.run.empty()) line("variable {} atom 0", names.run.substr(2));
    line("dump frames all custom {} \"{}\" id x y z vx vy vz{}{}", steps, names.dump,
         names.run.empty() ? "" : " ", names.run);
    line("dump_modify frames sort id format float %.17g first yes time yes every v_frame");
    line("thermo_style custom step time ke pe\nthermo_modify norm no\nthermo {}",
         std::max<std::uint64_t>(1, steps / 10));
    line("run {}", steps);
  }

 private:
  [[nodiscard]] static std::string group(std::size_t g) { return fmt::format("support{}", g + 1); }
  // Whether fix nve moves it.
  [[nodiscard]] bool by_velocity(std::size_t g) const {
    return !particles_.leads(particles_.supports[g]) && particles_.supports[g].mask != 7;
  }
  // What is held begins at rest along its axes: the kick is of all that moves.
  void still() {
    for (std::size_t g = 0; g < particles_.supports.size(); ++g) {
      std::string held;
      for (std::size_t axis = 0; axis < 3; ++axis)
        held += particles_.supports[g].mask >> axis & 1 ? " 0.0" : " NULL";
      line("velocity {} set{} units box", group(g), held);
    }
  }

  // Factor, sine and 1 - cosine of a motion, now and a step before, as they differ from the start.
  void motion(std::size_t m) {
    const simulate::Motion& of = particles_.motions[m];
    if (of.angle == 0 && of.translation == Vec3::Zero()) return;
    const double start = factor_at_start(particles_.courses[m]);
    const auto half = [&](double f) { return std::sin(0.5 * of.angle * f); };
    for (const char* when : {"t", "before"}) {
      const std::string now = fmt::format("{}{}", when, m + 1);
      line("variable share{} equal {}", now, factor(particles_.courses[m], when));
      line("variable part{} equal v_share{}-({:.17g})", now, now, start);
      if (of.angle == 0) continue;
      line("variable sine{} equal sin(({:.17g})*v_share{})-({:.17g})", now, of.angle, now,
           std::sin(of.angle * start));
      line("variable half{} equal sin(({:.17g})*v_share{})", now, 0.5 * of.angle, now);
      line("variable cosine{} equal 2.0*v_half{}*v_half{}-({:.17g})", now, now, now,
           2 * half(start) * half(start));
    }
  }

  [[nodiscard]] std::string way(std::size_t m, std::size_t axis, const char* when) const {
    const simulate::Motion& of = particles_.motions[m];
    const std::size_t first = 3 * particles_.forces.size();
    std::string sum =
        fmt::format("({:.17g})*v_part{}{}", of.translation[static_cast<Eigen::Index>(axis)], when, m + 1);
    if (of.angle != 0)
      append_text(sum, "+v_sine{}{}*c_element[{}]+v_cosine{}{}*c_element[{}]", when, m + 1, first + axis + 1,
                  when, m + 1, first + axis + 4);
    return sum;
  }

  void lead(std::size_t g) {
    const SupportGroup& of = particles_.supports[g];
    std::string ways, speeds;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t m = of.motion[axis];
      if (!(of.mask >> axis & 1)) {
        ways += " NULL";
        speeds += " NULL";
        continue;
      }
      const simulate::Motion& motion = particles_.motions[m];
      const char* kind = motion.angle != 0 ? "atom" : "equal";
      const std::string own = fmt::format("{}{}", kAxes[axis], g + 1);
      if (motion.angle == 0 && motion.translation == Vec3::Zero()) {
        ways += " v_still";
        speeds += " v_still";
        continue;
      }
      line("variable way{} {} {}", own, kind, way(m, axis, "t"));
      line("variable speed{} {} (v_way{}-({}))/{:.17g}", own, kind, own, way(m, axis, "before"),
           particles_.step);
      ways += " v_way" + own;
      speeds += " v_speed" + own;
    }
    line("fix {} {} move variable{}{}", group(g), group(g), ways, speeds);
  }

  const Particles& particles_;
  const BondTypes& types_;
};

}  // namespace

BondTypes bond_types(const std::vector<Spring>& springs) {
  BondTypes found;
  std::map<std::tuple<double, double, double>, std::uint32_t> known;
  for (const Spring& spring : springs) {
    const auto [type, fresh] = known.try_emplace({spring.stiffness, spring.length, spring.damping},
                                                 static_cast<std::uint32_t>(found.types.size()));
    if (fresh) found.types.push_back({0, 0, spring.stiffness, spring.length, spring.damping});
    found.of.push_back(type->second);
  }
  return found;
}

std::uint64_t write_data(const Particles& particles, const BondTypes& types, const std::string& head,
                         const std::string& path) {
  DataText text(path);
  text.add("{}\n\n{} atoms\n{} atom types\n{} bonds\n{} bond types\n", head, particles.mass.size(),
           2 * support_types(particles), particles.springs.size(), types.types.size());
  const Box box = bounding_box(particles.position);
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    text.add("{:.17g} {:.17g} {}lo {}hi\n", box.min[axis] - particles.longest,
             box.max[axis] + particles.longest, kAxes[axis], kAxes[axis]);
  // LAMMPS's energy is K (r - r0)^2
  text.add("\nBond Coeffs\n\n");
  for (std::size_t t = 0; t < types.types.size(); ++t)
    text.add("{} {:.17g} {:.17g}\n", t + 1, 0.5 * types.types[t].stiffness, types.types[t].length);
  text.add("\nAtoms # bond\n\n");
  for (std::size_t e = 0; e < particles.position.size(); ++e) {
    const Vec3& x = particles.position[e];
    text.add("{} {} {} {:.17g} {:.17g} {:.17g}\n", e + 1, particles.part[e] + 1, type_of(particles, e), x.x(),
             x.y(), x.z());
  }
  text.add("\nVelocities\n\n");
  for (std::size_t e = 0; e < particles.velocity.size(); ++e) {
    const Vec3& v = particles.velocity[e];
    text.add("{} {:.17g} {:.17g} {:.17g}\n", e + 1, v.x(), v.y(), v.z());
  }
  text.add("\nBonds\n\n");
  for (std::size_t b = 0; b < particles.springs.size(); ++b)
    text.add("{} {} {} {}\n", b + 1, types.of[b] + 1, particles.springs[b].a + 1, particles.springs[b].b + 1);
  write_elements(particles, text);
  return text.commit();
}

std::string run_name(std::uint64_t data, const std::string& script) {
  return fmt::format("{}{:016x}", kRunPrefix, hashed(data, script));
}

std::string input_script(const Particles& particles, const BondTypes& types,
                         const std::vector<std::string>& head, const InputNames& names) {
  Script script(particles, types);
  for (const std::string& each : head) script.line("# {}.", comment(each));
  script.line("");
  script.settings();
  script.reading(names);
  script.line("");
  script.acting();
  script.leading();
  script.starting();
  script.holding();
  script.line("");
  script.running(names);
  return script.text;
}

}  // namespace flexel::lammps
