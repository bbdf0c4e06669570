// What the module flexel-serve.so gives, the one that has libmicrohttpd: loading it, and the libraries that it needs, takes longer
// than `flexel --version`, so it is loaded where a page is served (serve.cpp). C functions and plain types, so that the module
// has nothing else of ours in it.
#pragma once
#include <cstddef>
#include <cstdint>

extern "C" {

// One answer. The bytes outlive the server.
struct FlexelServedFile {
  const char* path;  // of the URL, whole: nothing else is answered
  const char* type;
  const void* bytes;
  std::size_t size;
};

struct FlexelServeModule {
  // Answers GET for these files on 127.0.0.1, at a port that is free. Other methods, paths, hosts and origins are refused; a
  // request may have 16 KiB of headers and no content. Null: no port, `error` says why.
  void* (*start)(const FlexelServedFile* files, std::size_t count, const char* policy, std::uint16_t* port,
                 int* error);
  void (*stop)(void* server);
};

// The name of the module's one function, and its type.
#define FLEXEL_SERVE_MODULE flexel_serve_module
using FlexelServeModuleFunction = const FlexelServeModule*();
FlexelServeModuleFunction FLEXEL_SERVE_MODULE;
}
