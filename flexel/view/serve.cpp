// libmicrohttpd lies in a module of its own, which is loaded here. The token is 128 random bits.
#include "flexel/view/serve.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>

#include "base/error.h"
#include "base/program/own_program.h"
#include "flexel/view/serve_module.h"

namespace flexel::view {
namespace {

#define FLEXEL_TEXT_OF_SERVE(name) #name
#define FLEXEL_NAME_OF_SERVE(name) FLEXEL_TEXT_OF_SERVE(name)

// Loaded once, and never let go.
const FlexelServeModule& serve_module() {
  static const FlexelServeModule& kModule = []() -> const FlexelServeModule& {
    const std::string path = own_program("flexel-serve.so");
    void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    void* function = library == nullptr ? nullptr : dlsym(library, FLEXEL_NAME_OF_SERVE(FLEXEL_SERVE_MODULE));
    if (function == nullptr)
      throw InputError(fmt::format("{} cannot be loaded: install Flexel and libmicrohttpd again", path));
    return *reinterpret_cast<FlexelServeModuleFunction*>(function)();
  }();
  return kModule;
}

std::string random_token() {
  std::array<unsigned char, 16> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw InputError(fmt::format("the system gives no random numbers ({})", std::strerror(errno)));
  std::string token;
  for (const unsigned char byte : bytes) token += fmt::format("{:02x}", byte);
  return token;
}

ServedLive& live_of(void* context) {
  return *static_cast<ServedLive*>(context);
}

unsigned act(void* context, const char* bytes, std::size_t size, char* answer, std::size_t room) {
  try {
    const ServedLive::Answer given = live_of(context).act(std::string(bytes, size));
    std::memcpy(answer, given.bytes.data(), std::min(room, given.bytes.size()));
    return given.status;
  } catch (...) {
    return 500;
  }
}

void* open_reader(void* context, const char* client) {
  try {
    return live_of(context).open(client).release();
  } catch (...) {
    return nullptr;
  }
}

long next_bytes(void* reader, char* buffer, std::size_t size) {
  try {
    return static_cast<ServedLive::Reader*>(reader)->next(buffer, size);
  } catch (...) {
    return -1;
  }
}

void close_reader(void* reader) {
  delete static_cast<ServedLive::Reader*>(reader);
}

unsigned save(void* context, const char* name, void** bytes, std::size_t* size) {
  try {
    const ServedLive::Answer given = live_of(context).save(name);
    *bytes = std::malloc(given.bytes.size() + 1);
    if (*bytes == nullptr) return 500;
    std::memcpy(*bytes, given.bytes.data(), given.bytes.size());
    *size = given.bytes.size();
    return given.status;
  } catch (...) {
    return 500;
  }
}

}  // namespace

struct PageServer::Files {
  Page page;
  std::string root;
  FlexelServeLive live{};
  std::vector<std::string> paths;
  std::vector<FlexelServedFile> served;
  void add(const std::string& path, const char* type, const void* bytes, std::size_t size) {
    paths.push_back(path);
    served.push_back({nullptr, type, bytes, size});
  }
};

PageServer::PageServer(Page page, ServedLive* live) : files_(std::make_unique<Files>()) {
  files_->page = std::move(page);
  const std::string root = fmt::format("/{}/", random_token());
  const Page& kept = files_->page;
  files_->add(root, "text/html; charset=utf-8", kept.html.data(), kept.html.size());
  for (std::size_t f = 0; f < kept.data.size(); ++f)
    files_->add(fmt::format("{}data/{}", root, f), "application/octet-stream", kept.data[f].data(),
                kept.data[f].size());
  for (std::size_t f = 0; f < files_->paths.size(); ++f) files_->served[f].path = files_->paths[f].c_str();
  files_->root = root;
  files_->live = {live, files_->root.c_str(), kLargestPost, act, open_reader, next_bytes, close_reader, save};
  std::uint16_t port = 0;
  int error = 0;
  server_ = serve_module().start(files_->served.data(), files_->served.size(),
                                 live == nullptr ? nullptr : &files_->live, "frame-ancestors 'none'", &port,
                                 &error);
  if (server_ == nullptr)
    throw InputError(fmt::format("no port of 127.0.0.1 can be listened on ({}): --html writes a file instead",
                                 std::strerror(error)));
  url_ = fmt::format("http://127.0.0.1:{}{}", port, root);
}

PageServer::~PageServer() {
  serve_module().stop(server_);
}

}  // namespace flexel::view
