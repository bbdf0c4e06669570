// The stretches that live now are a stack; an update of a silent or quiet Progress goes to the one that it belongs to.
#include "base/program/progress_stretch.h"

#include <algorithm>

#include "base/program/silent_updates.h"

namespace flexel {

ProgressStretch* ProgressStretch::last_ = nullptr;

ProgressStretch::ProgressStretch(Progress& whole, double from, double to, const std::string& program,
                                 Progress::Mode mode)
    : whole_(whole), from_(from), to_(to), inner_(program, mode), before_(last_) {
  last_ = this;
  set_silent_update(&ProgressStretch::pass_on);
}

ProgressStretch::ProgressStretch(Progress& whole, double from, double to)
    : ProgressStretch(whole, from, to, "", Progress::Mode::silent) {}

ProgressStretch::ProgressStretch(Progress& whole, double from, double to, const std::string& warns_as)
    : ProgressStretch(whole, from, to, warns_as, Progress::Mode::quiet) {}

ProgressStretch::~ProgressStretch() {
  last_ = before_;
}

void ProgressStretch::pass_on(const Progress& inner, double share, const std::string& note) {
  for (ProgressStretch* each = last_; each != nullptr; each = each->before_) {
    if (&each->inner_ != &inner) continue;
    each->furthest_ = std::max(each->furthest_, std::min(share, 1.0));
    return each->whole_.update(each->from_ + each->furthest_ * (each->to_ - each->from_), note);
  }
}

}  // namespace flexel
