// stdin in pieces, cut into lines.
#include "simulate/live/pose_feed.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "base/error.h"

namespace flexel::simulate {
namespace {

constexpr std::size_t kLongestLine = 4096;  // bytes
constexpr int kWait = 100;                  // ms

bool readable(int wait) {
  pollfd descriptor = {STDIN_FILENO, POLLIN, 0};
  return ::poll(&descriptor, 1, wait) > 0;
}

}  // namespace

PoseFeed::PoseFeed(std::vector<std::shared_ptr<LiveTool>> tools) : tools_(std::move(tools)) {
  if (isatty(STDIN_FILENO) != 0)
    throw InputError("stdin is a terminal: pipe the poses of path = \"stdin\" in");
  for (const auto& tool : tools_)
    if (tools_.size() > 1 && tool->name.find_first_of(" \t,") != std::string::npos)
      throw InputError(
          fmt::format("several [[manipulator]] read stdin, where lines tell them apart by a name "
                      "without blanks: give \"{}\" another \"name\"",
                      tool->name));
}

// What is there now, but no more than a megabyte.
void PoseFeed::read() {
  std::array<char, 65536> piece;
  while (!closed_ && buffer_.size() < 16 * piece.size() && readable(0)) {
    const ssize_t got = ::read(STDIN_FILENO, piece.data(), piece.size());
    if (got > 0)
      buffer_.append(piece.data(), static_cast<std::size_t>(got));
    else if (got == 0)
      closed_ = true;
    else if (errno != EINTR && errno != EAGAIN)
      throw InputError("stdin", fmt::format("cannot read: {}", std::strerror(errno)));
  }
  if (closed_ && !buffer_.empty() && buffer_.back() != '\n') buffer_ += '\n';
}

template <class Take>
void PoseFeed::take_lines(const Take& take) {
  std::size_t begin = 0;
  for (std::size_t end = 0; !ended_ && (end = buffer_.find('\n', begin)) != std::string::npos;
       begin = end + 1) {
    const std::string place = fmt::format("stdin:{}", ++line_);
    if (end - begin > kLongestLine) throw InputError(place, "is too long for a pose");
    const std::optional<PoseLine> pose = parse_pose_line(buffer_.substr(begin, end - begin), place);
    if (!pose) continue;
    ended_ = pose->end;
    if (ended_) continue;
    ++poses_;
    take(tool_of(*pose, place), *pose, place);
  }
  buffer_.erase(0, begin);
  if (buffer_.size() > kLongestLine)
    throw InputError(fmt::format("stdin:{}", line_ + 1), "is too long for a pose");
}

LiveTool& PoseFeed::tool_of(const PoseLine& pose, const std::string& place) const {
  if (pose.tool.empty() && tools_.size() == 1) return *tools_.front();
  std::string names;
  for (const auto& tool : tools_) {
    if (tool->name == pose.tool) return *tool;
    names += (names.empty() ? "\"" : ", \"") + tool->name + "\"";
  }
  if (pose.tool.empty())
    throw InputError(place, fmt::format("several [[manipulator]] read stdin: begin the line with the name of "
                                        "one, {}",
                                        names));
  throw InputError(place, fmt::format("\"{}\" is no [[manipulator]] that reads stdin; {}", pose.tool,
                                      tools_.size() > 1 ? "they are " + names : names + " is"));
}

void PoseFeed::take(double now, double least) {
  if (ended_) return;
  read();
  take_lines(
      [&](LiveTool& tool, const PoseLine& pose, const std::string&) { tool.lead_to(pose, now, least); });
}

void PoseFeed::wait() {
  if (ended_ || closed_ || !readable(kWait)) return;
  read();
  take_lines(
      [](LiveTool& tool, const PoseLine& pose, const std::string& place) { tool.add_key(pose, place); });
}

bool PoseFeed::reaches(double until) const {
  if (ended_ || closed_) return true;
  for (const auto& tool : tools_)
    if (tool->path.time.empty() || tool->path.time.back() < until) return false;
  return true;
}

void PoseFeed::forget(double now) {
  for (const auto& tool : tools_) tool->forget(now);
}

}  // namespace flexel::simulate
