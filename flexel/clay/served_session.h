// A session behind a server of pages.
#pragma once
#include <atomic>

#include "flexel/clay/clay_session.h"
#include "flexel/view/serve.h"

namespace flexel::clay {

class ServedSession : public view::ServedLive {
 public:
  explicit ServedSession(ClaySession& session) : session_(session) {}
  [[nodiscard]] Answer act(const std::string& message) override;
  [[nodiscard]] std::unique_ptr<Reader> open(const std::string& client) override;
  [[nodiscard]] Answer save(const std::string& name) override;

 private:
  class Stream;
  ClaySession& session_;
  std::atomic<int> readers_ = 0;
};

}  // namespace flexel::clay
