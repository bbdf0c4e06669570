// Serves a page to this machine's browser.
#pragma once
#include <memory>
#include <string>

#include "flexel/view/page.h"

namespace flexel::view {

// Answers on 127.0.0.1 while it lives: the page and its data, to whoever knows the URL, and nothing else.
class PageServer {
 public:
  // Throws InputError: the module that serves is not there, no port is free.
  explicit PageServer(Page page);
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
