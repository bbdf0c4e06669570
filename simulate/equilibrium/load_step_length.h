// How long the load steps of a run are.
#pragma once

namespace flexel::simulate {

// Shares of the load. A step that fails is halved; easy ones let the next be twice as long. Where a length
// fails that was just doubled, as on a way with many bifurcations, it is doubled again only after 2 easy steps,
// then 4, 8 and 16: each failure costs more iterations than such steps do. One that serves ends the wait.
class LoadStepLength {
 public:
  explicit LoadStepLength(double longest) : longest_(longest), length_(longest) {}

  [[nodiscard]] double get() const { return length_; }
  // After a step of `tried`, which is less than get() where it would have passed the whole load.
  void failed(double tried);
  void succeeded(bool easy);
  // From here on none is longer than now.
  void stop_growing() { longest_ = length_; }
  void set(double length);

 private:
  double longest_, length_;
  bool doubled_ = false;     // and not tried since
  int wait_ = 1, easy_ = 0;  // easy steps before it is doubled, and so far
};

}  // namespace flexel::simulate
