// Fewer readers than the server has connections, so that acts get through.
#include "flexel/clay/served_session.h"

namespace flexel::clay {
namespace {

constexpr int kMostReaders = 20;
static_assert(kLargestMessage == view::kLargestPost);

}  // namespace

class ServedSession::Stream : public view::ServedLive::Reader {
 public:
  Stream(ServedSession& served, std::string client)
      : served_(served), client_(std::move(client)), reader_(served.session_.hub()) {
    served_.session_.joined(client_);
  }
  ~Stream() override {
    served_.session_.left(client_);
    --served_.readers_;
  }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  [[nodiscard]] long next(char* buffer, std::size_t size) override { return reader_.next(buffer, size); }

 private:
  ServedSession& served_;
  std::string client_;
  FrameHub::Reader reader_;
};

view::ServedLive::Answer ServedSession::act(const std::string& message) {
  const clay::Answer answer = session_.act(message);
  return {answer.status, answer.bytes.substr(0, 1000)};
}

std::unique_ptr<view::ServedLive::Reader> ServedSession::open(const std::string& client) {
  if (!is_client_name(client)) return nullptr;
  if (++readers_ > kMostReaders) {
    --readers_;
    return nullptr;
  }
  return std::make_unique<Stream>(*this, client);
}

view::ServedLive::Answer ServedSession::save(const std::string& name) {
  const clay::Answer answer = session_.save(name);
  return {answer.status, answer.bytes};
}

}  // namespace flexel::clay
