// Halves and doubles; waits longer each time that doubling was of no use.
#include "simulate/equilibrium/load_step_length.h"

#include <algorithm>

namespace flexel::simulate {
namespace {

constexpr int kLongestWait = 16;  // easy steps

}  // namespace

void LoadStepLength::failed(double tried) {
  if (doubled_) wait_ = std::min(2 * wait_, kLongestWait);
  doubled_ = false;
  easy_ = 0;
  length_ = std::min(length_, tried) / 2;
}

void LoadStepLength::succeeded(bool easy) {
  if (doubled_) wait_ = 1;
  doubled_ = false;
  if (!easy || ++easy_ < wait_ || !(length_ < longest_)) return;
  easy_ = 0;
  doubled_ = true;
  length_ = std::min(longest_, 2 * length_);
}

void LoadStepLength::set(double length) {
  length_ = length;
  doubled_ = false;
  easy_ = 0;
}

}  // namespace flexel::simulate
