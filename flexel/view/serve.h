// Serves a page to this machine's browser.
#pragma once
#include <memory>
#include <string>

#include "flexel/view/page.h"

namespace flexel::view {

// What changes while a page is served. Called from several threads.
class ServedLive {
 public:
  struct Answer {
    unsigned status = 200;  // of HTTP
    std::string bytes;
  };
  class Reader {
   public:
    virtual ~Reader() = default;
    // Up to `size` bytes; 0: nothing yet, after a short wait; below 0: the end.
    [[nodiscard]] virtual long next(char* buffer, std::size_t size) = 0;
  };
  virtual ~ServedLive() = default;
  [[nodiscard]] virtual Answer act(const std::string& message) = 0;  // POST act; at most 1,000 bytes
  // GET live?client=NAME; nothing where it is refused.
  [[nodiscard]] virtual std::unique_ptr<Reader> open(const std::string& client) = 0;
  [[nodiscard]] virtual Answer save(const std::string& name) = 0;  // GET save/NAME
};

constexpr std::size_t kLargestPost = 16384;  // bytes

// Answers on 127.0.0.1 while it lives: the page and its data, to whoever knows the URL, and nothing else.
class PageServer {
 public:
  // Throws InputError: the module that serves is not there, no port is free.
  // `live`, or null, outlives it.
  explicit PageServer(Page page, ServedLive* live = nullptr);
  ~PageServer();
  PageServer(const PageServer&) = delete;
  PageServer& operator=(const PageServer&) = delete;
  [[nodiscard]] const std::string& url() const { return url_; }

 private:
  struct Files;
  std::unique_ptr<Files> files_;
  void* server_ = nullptr;
  std::string url_;
};

}  // namespace flexel::view
