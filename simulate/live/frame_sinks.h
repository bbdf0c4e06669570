// Where the frames of a live run go: stdout, or a socket on the loopback that any number of readers attach
// to. No reader holds the run up: what one is too slow for is dropped, frame by frame.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace flexel::simulate {

class FrameSinks {
 public:
  // `to`: "-" (stdout), "tcp:PORT" (127.0.0.1; 0: any that is free) or "unix:PATH". Throws InputError.
  explicit FrameSinks(const std::string& to);
  ~FrameSinks();
  FrameSinks(const FrameSinks&) = delete;
  FrameSinks& operator=(const FrameSinks&) = delete;

  // "stdout", "tcp:38123", "unix:/tmp/flexel"
  [[nodiscard]] const std::string& name() const { return name_; }
  // Lets readers in; each gets `header` first.
  void let_in(const std::string& header);
  // A frame to every reader that has taken the one before. Throws ReaderClosedPipe where stdout's went away;
  // readers of a socket may.
  void send(const std::string& frame);
  // At the end: waits a moment for readers to take what they have begun to.
  void flush();
  [[nodiscard]] int listener() const { return listener_; }          // a descriptor, or -1
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }  // frames x readers
  [[nodiscard]] std::uint64_t readers() const { return readers_; }  // that came
  [[nodiscard]] std::uint64_t sent() const { return sent_; }        // frames x readers

 private:
  struct Reader {
    int descriptor = -1;
    bool socket = false;
    std::string pending = {};  // what it has not taken yet
    bool gone = false;
  };
  void listen_tcp(const std::string& port);
  void listen_unix(const std::string& path);
  void push(Reader& reader);

  std::string name_, path_;  // of the socket's file, which goes when the run does
  int listener_ = -1;
  std::vector<Reader> open_;
  bool greeted_ = false;  // stdout
  std::uint64_t dropped_ = 0, readers_ = 0, sent_ = 0;
};

}  // namespace flexel::simulate
