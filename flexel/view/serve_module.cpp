// Linked with libmicrohttpd, and with nothing of ours. The Host header is checked so that a name that resolves to this machine
// (DNS rebinding) gets nothing, the Origin so that no other page reads it; what opens the page is the token in its path.
#include "flexel/view/serve_module.h"

#include <arpa/inet.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <vector>

namespace {

constexpr const char* kText = "text/plain; charset=utf-8";
// A connection that asks for nothing is soon given to another; one whose page is being sent may be slow.
constexpr unsigned kMostConnections = 32, kSecondsToAsk = 2, kSecondsToTake = 30;
constexpr std::size_t kMemory = 32768;  // bytes a connection, half of it for headers

struct Server {
  MHD_Daemon* daemon = nullptr;
  std::vector<FlexelServedFile> files;
  std::string policy;
  std::vector<std::string> hosts;  // that it goes by
  const FlexelServeLive* live = nullptr;
};

// What comes with a request.
struct Content {
  std::string bytes;
  bool too_large = false;
};

bool is_own_host(const Server& server, const char* host) {
  for (const std::string& own : server.hosts)
    if (host != nullptr && own == host) return true;
  return false;
}

bool is_own_origin(const Server& server, const char* origin) {
  constexpr const char* kScheme = "http://";
  if (origin == nullptr) return true;
  return std::strncmp(origin, kScheme, std::strlen(kScheme)) == 0 &&
         is_own_host(server, origin + std::strlen(kScheme));
}

MHD_Result send(MHD_Connection* connection, const Server& server, unsigned status, const char* type,
                MHD_Response* response) {
  if (response == nullptr) return MHD_NO;
  const auto header = [&](const char* name, const char* value) {
    (void)MHD_add_response_header(response, name, value);
  };
  header("Content-Type", type);
  header("Content-Security-Policy", server.policy.c_str());
  header("X-Content-Type-Options", "nosniff");
  header("X-Frame-Options", "DENY");
  header("Referrer-Policy", "no-referrer");
  header("Cross-Origin-Resource-Policy", "same-origin");
  header("Cross-Origin-Opener-Policy", "same-origin");
  header("Cache-Control", "no-store");
  if (status == MHD_HTTP_METHOD_NOT_ALLOWED) header("Allow", server.live != nullptr ? "GET, POST" : "GET");
  const MHD_Result queued = MHD_queue_response(connection, status, response);
  MHD_destroy_response(response);
  return queued;
}

MHD_Result answer(MHD_Connection* connection, const Server& server, unsigned status,
                  const FlexelServedFile& file) {
  return send(
      connection, server, status, file.type,
      MHD_create_response_from_buffer(file.size, const_cast<void*>(file.bytes), MHD_RESPMEM_PERSISTENT));
}

MHD_Result refuse(MHD_Connection* connection, const Server& server, unsigned status, const char* why) {
  return answer(connection, server, status, {nullptr, kText, why, std::strlen(why)});
}

MHD_Result answer_act(MHD_Connection* connection, const Server& server, const Content& content) {
  if (content.too_large)
    return refuse(connection, server, MHD_HTTP_CONTENT_TOO_LARGE, "the message is too large\n");
  char text[1024] = {};
  const unsigned status = server.live->act(server.live->context, content.bytes.data(), content.bytes.size(),
                                           text, sizeof text - 1);
  return send(connection, server, status, kText,
              MHD_create_response_from_buffer(std::strlen(text), text, MHD_RESPMEM_MUST_COPY));
}

MHD_Result answer_live(MHD_Connection* connection, const Server& server) {
  const char* client = MHD_lookup_connection_value(connection, MHD_GET_ARGUMENT_KIND, "client");
  void* reader = server.live->open(server.live->context, client == nullptr ? "" : client);
  if (reader == nullptr)
    return refuse(connection, server, MHD_HTTP_SERVICE_UNAVAILABLE, "too many readers, or no client named\n");
  struct Stream {
    const FlexelServeLive* live;
    void* reader;
  };
  const auto next = [](void* stream, std::uint64_t, char* buffer, size_t size) -> ssize_t {
    const Stream& own = *static_cast<Stream*>(stream);
    const long count = own.live->next(own.reader, buffer, size);
    return count < 0 ? MHD_CONTENT_READER_END_OF_STREAM : count;
  };
  const auto close = [](void* stream) {
    auto* own = static_cast<Stream*>(stream);
    own->live->close(own->reader);
    delete own;
  };
  constexpr size_t kBlock = 65536;
  return send(connection, server, MHD_HTTP_OK, "application/octet-stream",
              MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, kBlock, next,
                                                new Stream{server.live, reader}, close));
}

MHD_Result answer_save(MHD_Connection* connection, const Server& server, const char* name) {
  void* bytes = nullptr;
  std::size_t size = 0;
  const unsigned status = server.live->save(server.live->context, name, &bytes, &size);
  if (bytes == nullptr) return refuse(connection, server, MHD_HTTP_INTERNAL_SERVER_ERROR, "no memory\n");
  return send(connection, server, status, status == MHD_HTTP_OK ? "application/octet-stream" : kText,
              MHD_create_response_from_buffer(size, bytes, MHD_RESPMEM_MUST_FREE));
}

// The rest of a path after the prefix of what is live; null for other paths.
const char* live_path(const Server& server, const char* path) {
  if (server.live == nullptr) return nullptr;
  const std::size_t size = std::strlen(server.live->prefix);
  return std::strncmp(path, server.live->prefix, size) == 0 ? path + size : nullptr;
}

// Takes what has come of the content of POST; nothing where the method or the path has none.
void take(const Server& server, Content& content, const char* bytes, size_t size) {
  if (content.bytes.size() + size > server.live->most)
    content.too_large = true;
  else
    content.bytes.append(bytes, size);
}

MHD_Result on_request(void* context, MHD_Connection* connection, const char* path, const char* method,
                      const char*, const char* upload, size_t* upload_size, void** own) {
  const Server& server = *static_cast<const Server*>(context);
  const auto header = [&](const char* name) {
    return MHD_lookup_connection_value(connection, MHD_HEADER_KIND, name);
  };
  if (!is_own_host(server, header("Host")) || !is_own_origin(server, header("Origin")))
    return refuse(connection, server, MHD_HTTP_FORBIDDEN, "flexel view answers its own page only\n");
  (void)MHD_set_connection_option(connection, MHD_CONNECTION_OPTION_TIMEOUT, kSecondsToTake);
  const char* live = live_path(server, path);
  if (live != nullptr && std::strcmp(live, "act") == 0 && std::strcmp(method, "POST") == 0) {
    if (*own == nullptr) {
      *own = new Content;
      return MHD_YES;
    }
    auto& content = *static_cast<Content*>(*own);
    if (*upload_size == 0) return answer_act(connection, server, content);
    take(server, content, upload, *upload_size);
    *upload_size = 0;
    return MHD_YES;
  }
  if (std::strcmp(method, "GET") != 0)
    return refuse(connection, server, MHD_HTTP_METHOD_NOT_ALLOWED, "flexel view answers GET only\n");
  if (live != nullptr && std::strcmp(live, "live") == 0) return answer_live(connection, server);
  if (live != nullptr && std::strncmp(live, "save/", 5) == 0)
    return answer_save(connection, server, live + 5);
  for (const FlexelServedFile& file : server.files)
    if (std::strcmp(file.path, path) == 0) return answer(connection, server, MHD_HTTP_OK, file);
  return refuse(connection, server, MHD_HTTP_NOT_FOUND, "flexel view has no such page\n");
}

void on_end(void*, MHD_Connection*, void** own, MHD_RequestTerminationCode) {
  delete static_cast<Content*>(*own);
  *own = nullptr;
}

// A socket that listens on a free port of the loopback address; below 0: none, and errno says why.
int listen_on_loopback(std::uint16_t* port) {
  const int listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  auto* general = reinterpret_cast<sockaddr*>(&address);
  if (listener < 0) return listener;
  if (bind(listener, general, size) == 0 && listen(listener, static_cast<int>(kMostConnections)) == 0 &&
      getsockname(listener, general, &size) == 0) {
    *port = ntohs(address.sin_port);
    return listener;
  }
  const int error = errno;
  close(listener);
  errno = error;
  return -1;
}

void* start(const FlexelServedFile* files, std::size_t count, const FlexelServeLive* live, const char* policy,
            std::uint16_t* port, int* error) {
  const int listener = listen_on_loopback(port);
  if (listener < 0) {
    *error = errno;
    return nullptr;
  }
  const std::string number = std::to_string(*port);
  auto* server = new Server{
      nullptr, {files, files + count}, policy, {"127.0.0.1:" + number, "localhost:" + number}, live};
  // Readers of a stream wait in next(), each in a thread of its own.
  const unsigned threads = live == nullptr ? 0U : static_cast<unsigned>(MHD_USE_THREAD_PER_CONNECTION);
  server->daemon =
      MHD_start_daemon(MHD_USE_INTERNAL_POLLING_THREAD | threads, 0, nullptr, nullptr, on_request, server,
                       MHD_OPTION_NOTIFY_COMPLETED, on_end, nullptr, MHD_OPTION_LISTEN_SOCKET, listener,
                       MHD_OPTION_CONNECTION_LIMIT, kMostConnections, MHD_OPTION_CONNECTION_MEMORY_LIMIT,
                       kMemory, MHD_OPTION_CONNECTION_TIMEOUT, kSecondsToAsk, MHD_OPTION_END);
  if (server->daemon != nullptr) return server;
  *error = errno;
  close(listener);
  delete server;
  return nullptr;
}

void stop(void* given) {
  auto* server = static_cast<Server*>(given);
  MHD_stop_daemon(server->daemon);
  delete server;
}

}  // namespace

const FlexelServeModule* FLEXEL_SERVE_MODULE() {
  static const FlexelServeModule kModule = {start, stop};
  return &kModule;
}
