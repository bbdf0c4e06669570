// Frames to any number of readers, each of which gets the newest when it has taken the one before.
#pragma once
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

namespace flexel::clay {

class FrameHub {
 public:
  // Every reader gets `header` first.
  explicit FrameHub(std::string header) : header_(std::move(header)) {}

  // `head`: the line of the frame that says nothing new and has no positions, for readers that would wait for long.
  void publish(std::string frame, std::string head);
  // From now on readers end.
  void close();

  class Reader {
   public:
    explicit Reader(FrameHub& hub) : hub_(hub), rest_(std::make_shared<const std::string>(hub.header_)) {}
    // At most `size` bytes of what comes next, after a wait of at most a fifth of a second; 0: nothing yet, below 0: the end.
    [[nodiscard]] long next(char* buffer, std::size_t size);

   private:
    FrameHub& hub_;
    std::shared_ptr<const std::string> rest_;
    std::size_t taken_ = 0;
    std::uint64_t seen_ = 0;
    int silent_ = 0;  // waits without a frame
  };

 private:
  std::string header_;
  std::mutex mutex_;
  std::condition_variable came_;
  std::shared_ptr<const std::string> frame_, head_;
  std::uint64_t number_ = 0;
  bool closed_ = false;
};

}  // namespace flexel::clay
