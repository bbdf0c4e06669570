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

// A connection that asks for nothing is soon given to another; one whose page is being sent may be slow.
constexpr unsigned kMostConnections = 32, kSecondsToAsk = 2, kSecondsToTake = 30;
constexpr std::size_t kMemory = 32768;  // bytes a connection, half of it for headers

struct Server {
  MHD_Daemon* daemon = nullptr;
  std::vector<FlexelServedFile> files;
  std::string policy;
  std::vector<std::string> hosts;  // that it goes by
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

MHD_Result answer(MHD_Connection* connection, const Server& server, unsigned status,
                  const FlexelServedFile& file) {
  MHD_Response* response =
      MHD_create_response_from_buffer(file.size, const_cast<void*>(file.bytes), MHD_RESPMEM_PERSISTENT);
  if (response == nullptr) return MHD_NO;
  const auto header = [&](const char* name, const char* value) {
    (void)MHD_add_response_header(response, name, value);
  };
  header("Content-Type", file.type);
  header("Content-Security-Policy", server.policy.c_str());
  header("X-Content-Type-Options", "nosniff");
  header("X-Frame-Options", "DENY");
  header("Referrer-Policy", "no-referrer");
  header("Cross-Origin-Resource-Policy", "same-origin");
  header("Cross-Origin-Opener-Policy", "same-origin");
  header("Cache-Control", "no-store");
  if (status == MHD_HTTP_METHOD_NOT_ALLOWED) header("Allow", "GET");
  const MHD_Result queued = MHD_queue_response(connection, status, response);
  MHD_destroy_response(response);
  return queued;
}

MHD_Result refuse(MHD_Connection* connection, const Server& server, unsigned status, const char* why) {
  return answer(connection, server, status, {nullptr, "text/plain; charset=utf-8", why, std::strlen(why)});
}

MHD_Result on_request(void* context, MHD_Connection* connection, const char* path, const char* method,
                      const char*, const char*, size_t*, void**) {
  const Server& server = *static_cast<const Server*>(context);
  const auto header = [&](const char* name) {
    return MHD_lookup_connection_value(connection, MHD_HEADER_KIND, name);
  };
  if (!is_own_host(server, header("Host")) || !is_own_origin(server, header("Origin")))
    return refuse(connection, server, MHD_HTTP_FORBIDDEN, "flexel view answers its own page only\n");
  if (std::strcmp(method, "GET") != 0)
    return refuse(connection, server, MHD_HTTP_METHOD_NOT_ALLOWED, "flexel view answers GET only\n");
  for (const FlexelServedFile& file : server.files)
    if (std::strcmp(file.path, path) == 0) {
      (void)MHD_set_connection_option(connection, MHD_CONNECTION_OPTION_TIMEOUT, kSecondsToTake);
      return answer(connection, server, MHD_HTTP_OK, file);
    }
  return refuse(connection, server, MHD_HTTP_NOT_FOUND, "flexel view has no such page\n");
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

void* start(const FlexelServedFile* files, std::size_t count, const char* policy, std::uint16_t* port,
            int* error) {
  const int listener = listen_on_loopback(port);
  if (listener < 0) {
    *error = errno;
    return nullptr;
  }
  const std::string number = std::to_string(*port);
  auto* server =
      new Server{nullptr, {files, files + count}, policy, {"127.0.0.1:" + number, "localhost:" + number}};
  server->daemon = MHD_start_daemon(MHD_USE_INTERNAL_POLLING_THREAD, 0, nullptr, nullptr, on_request, server,
                                    MHD_OPTION_LISTEN_SOCKET, listener, MHD_OPTION_CONNECTION_LIMIT,
                                    kMostConnections, MHD_OPTION_CONNECTION_MEMORY_LIMIT, kMemory,
                                    MHD_OPTION_CONNECTION_TIMEOUT, kSecondsToAsk, MHD_OPTION_END);
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
