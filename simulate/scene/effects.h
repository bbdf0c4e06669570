// The list of effects. A new one is added here and nowhere else.
#pragma once
#include <tuple>

#include "simulate/effects/bonds.h"
#include "simulate/effects/contact.h"
#include "simulate/effects/damping.h"
#include "simulate/effects/drag.h"
#include "simulate/effects/fracture.h"
#include "simulate/effects/gravity.h"
#include "simulate/effects/initial_velocity.h"
#include "simulate/effects/loads.h"
#include "simulate/effects/plasticity.h"
#include "simulate/effects/rigid.h"
#include "simulate/effects/supports.h"

namespace flexel::simulate {

template <class... E>
struct EffectList {
  using Parameters = std::tuple<typename E::Parameters...>;

  static void parse(TableReader& scene, Parameters& parameters) {
    (E::parse(scene, std::get<typename E::Parameters>(parameters)), ...);
  }

  // The passes of the effects that the scene calls for, in the order of the list.
  [[nodiscard]] static std::vector<Pass> passes(const Parameters& parameters, const Problem& problem) {
    std::vector<Pass> result;
    const auto add = [&](auto made) {
      if (!made) return;
      if constexpr (requires { made->companion(); }) {
        auto companion = made->companion();
        result.push_back(make_pass(std::move(*made)));
        if (companion) result.push_back(make_pass(std::move(*companion)));
      } else {
        result.push_back(make_pass(std::move(*made)));
      }
    };
    (add(E::make(std::get<typename E::Parameters>(parameters), problem)), ...);
    return result;
  }
};

using Effects = EffectList<Gravity, Loads, Ties, Bonds, Damping, InitialVelocity, Plasticity, Fracture, Drag,
                           RigidParts, Contact>;

}  // namespace flexel::simulate
