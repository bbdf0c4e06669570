// The scopes of a thread are a stack: what is told goes to the innermost, and from there outwards.
#include "base/program/share_scope.h"

#include <utility>

#include "base/program/progress.h"

namespace flexel {
namespace {

thread_local const ShareScope* innermost_scope = nullptr;

}  // namespace

ShareScope::ShareScope(Progress& progress, double from, double to, std::string note)
    : progress_(&progress),
      from_(from),
      to_(to),
      note_(std::move(note)),
      around_(std::exchange(innermost_scope, this)) {
  tell_share(0);
}

ShareScope::ShareScope(Hear hear) : hear_(std::move(hear)), around_(std::exchange(innermost_scope, this)) {}

ShareScope::ShareScope(double from, double to)
    : from_(from), to_(to), around_(std::exchange(innermost_scope, this)) {
  if (around_ != nullptr) progress_ = around_->progress_;
}

ShareScope::~ShareScope() {
  innermost_scope = around_;
}

void ShareScope::hear(double share, const std::string& note) const {
  const double whole = from_ + std::clamp(share, 0.0, 1.0) * (to_ - from_);
  const std::string& said = note.empty() ? note_ : note;
  if (hear_) return hear_(whole);
  if (around_ != nullptr && around_->progress_ == progress_) return around_->hear(whole, said);
  if (progress_ != nullptr) progress_->update(whole, said);
}

void tell_share(double share) {
  if (innermost_scope != nullptr) innermost_scope->hear(share, "");
}

}  // namespace flexel
