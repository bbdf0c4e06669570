// A frame is kept while some reader takes it; none is queued.
#include "flexel/clay/frame_hub.h"

#include <algorithm>
#include <chrono>
#include <cstring>

namespace flexel::clay {
namespace {

constexpr std::chrono::milliseconds kWait{200};
constexpr int kSilence = 5;  // waits: a line a second says that the run lives

}  // namespace

void FrameHub::publish(std::string frame, std::string head) {
  {
    const std::lock_guard lock(mutex_);
    frame_ = std::make_shared<const std::string>(std::move(frame));
    head_ = std::make_shared<const std::string>(std::move(head));
    ++number_;
  }
  came_.notify_all();
}

void FrameHub::close() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  came_.notify_all();
}

long FrameHub::Reader::next(char* buffer, std::size_t size) {
  if (taken_ == rest_->size()) {
    std::unique_lock lock(hub_.mutex_);
    hub_.came_.wait_for(lock, kWait, [&] { return hub_.closed_ || hub_.number_ != seen_; });
    if (hub_.closed_) return -1;
    if (hub_.number_ != seen_) {
      rest_ = hub_.frame_;
      silent_ = 0;
    } else if (hub_.head_ && ++silent_ >= kSilence) {
      rest_ = hub_.head_;
      silent_ = 0;
    } else {
      return 0;
    }
    seen_ = hub_.number_;
    taken_ = 0;
  }
  const std::size_t count = std::min(size, rest_->size() - taken_);
  std::memcpy(buffer, rest_->data() + taken_, count);
  taken_ += count;
  return static_cast<long>(count);
}

}  // namespace flexel::clay
