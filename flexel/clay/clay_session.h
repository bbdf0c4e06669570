// Hands at a part: acts come in from any thread, one thread moves the part, frames go out.
#pragma once
#include <chrono>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "flexel/clay/clay_document.h"
#include "flexel/clay/frame_hub.h"
#include "flexel/clay/pulled_body.h"

namespace flexel::clay {

// An answer by HTTP.
struct Answer {
  unsigned status = 200;
  std::string bytes;
};

class ClaySession {
 public:
  // `base`: a scene's text, or "". Throws InputError: of the scene.
  ClaySession(std::shared_ptr<const Body> body, std::string material, std::string base);
  ClaySession(const ClaySession&) = delete;
  ClaySession& operator=(const ClaySession&) = delete;
  ~ClaySession();

  // 200 and {"line": poses taken so far}; 400: no message; 409: another client holds the tool; 429: too many wait.
  [[nodiscard]] Answer act(const std::string& message);
  // A file: "part.stl" (or another format), "scene.toml", "scene-1.toml" ..., "rest.vtu", which wait until
  // the part is at rest; "rest.f32", "surface-3", which do not.
  // 404: no such file; 500: why it cannot be written.
  [[nodiscard]] Answer save(const std::string& name);
  // Readers of frames come with the name of their client, and go.
  void joined(const std::string& client);
  void left(const std::string& client);
  [[nodiscard]] FrameHub& hub() { return hub_; }
  // Nothing is waited for any more: readers end, files are refused, the part stays where it is.
  void close();

 private:
  using Clock = std::chrono::steady_clock;
  struct Carving {                     // along the way of the hand
    std::shared_ptr<const Body> body;  // that it began with
    std::vector<CarvedWay> ways;       // one each time that the ball was put down
    std::vector<std::uint8_t> holds;   // (ways) whether some element is in it
    std::size_t places = 0;            // of all ways
    bool changed = false, refused = false;
    std::string nothing;  // why nothing goes so far
  };
  struct Stroke {                  // of the hand that leads the last tool, or carves
    std::optional<ToolPose> hand;  // nothing: the tool is led itself, to `target`
    ToolPose target;
    double spring = 0, part = 0;  // N/m: of the hand, of the part at the tool; 0: not known yet
    bool begun = false;
    std::optional<Carving> carving;
  };
  void run();
  void give_tool(const std::string& client);
  [[nodiscard]] bool wait(std::optional<Act>& act);
  void perform(const Act& act);
  void change(const Act& act);
  void grab(const Act& act, ClayDocument& next) const;
  void push(const Act& act, ClayDocument& next) const;
  void keep(ClayDocument& next) const;
  void paint(const Act& act, ClayDocument& next) const;
  void alter(const Act& act, ClayDocument& next) const;
  void draw(const Act& act);
  void carve_drawn();
  void take_up(ClayDocument next);
  void take_up_carved(ClayDocument next);
  void stay();
  void cancel();
  void halt();
  void travel(bool back);
  void lead(bool obeys = true);
  void arrive();
  void refine();
  void settle(bool settled);
  [[nodiscard]] ToolPose goal() const;
  [[nodiscard]] bool on_its_way() const;
  [[nodiscard]] bool hand_moves() const { return Clock::now() < quiet_; }
  [[nodiscard]] bool led_to(const ToolPose& pose);
  void rest();
  void retreat();
  [[nodiscard]] std::vector<ToolPose> poses_with(const ToolPose& last) const;
  void learn_stiffness(const ToolPose& before, const Vec3& force);
  void remember(ClayDocument before);
  [[nodiscard]] bool more_waits();
  [[nodiscard]] bool draws_on();
  void publish();
  [[nodiscard]] std::optional<Answer> drawn(const std::string& name);
  [[nodiscard]] std::string head(std::size_t bytes) const;
  [[nodiscard]] Answer mapped(const std::string& name, const Body& body) const;
  [[nodiscard]] std::function<void()> stop_asked();

  const std::string base_;
  const std::shared_ptr<const Body> first_;
  FrameHub hub_;
  // Of the thread that moves the part
  ClayDocument document_;
  std::vector<ClayDocument> undo_, redo_;
  std::unique_ptr<PulledBody> model_;
  Stroke stroke_;
  Clock::time_point moved_;  // when the last pose was taken up
  Clock::time_point quiet_;  // when the hand will have rested for long enough to find the equilibrium
  std::uint64_t frame_ = 0, grabs_ = 0;
  std::string said_;
  // Of all, under the mutex
  std::mutex mutex_;
  std::condition_variable changed_;
  struct Waiting {
    Act act;
    std::uint64_t line = 0;  // number of the last pose, or place of a way, up to it
  };
  std::deque<Waiting> queue_;
  std::string holder_;
  std::map<std::string, int> readers_;  // of each client
  Clock::time_point heard_;             // from the holder
  std::uint64_t line_ = 0, taken_ = 0;  // poses that came, that the part follows
  bool settled_ = true, stop_ = false;
  bool news_ = false;                                                     // the holder is another
  ClayDocument shown_;                                                    // the last in equilibrium
  std::pair<std::uint64_t, std::shared_ptr<const std::string>> surface_;  // of the last frame
  std::thread thread_;
};

}  // namespace flexel::clay
