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

// What changes while it is served. Called from the threads of the connections; nothing may be thrown.
struct FlexelServeLive {
  void* context;
  const char* prefix;  // of the paths below, with a slash at its end
  // POST PREFIXact, of at most `most` bytes: the status; `answer` gets a text of at most `room` bytes.
  std::size_t most;
  unsigned (*act)(void* context, const char* bytes, std::size_t size, char* answer, std::size_t room);
  // GET PREFIXlive?client=NAME: a stream. next() gives up to `size` bytes, 0 for nothing yet after a short wait, below 0 at
  // the end.
  void* (*open)(void* context, const char* client);
  long (*next)(void* reader, char* buffer, std::size_t size);
  void (*close)(void* reader);
  // GET PREFIXsave/NAME: the status, and bytes that free() frees.
  unsigned (*save)(void* context, const char* name, void** bytes, std::size_t* size);
};

struct FlexelServeModule {
  // Answers GET for these files on 127.0.0.1, at a port that is free, and for what is `live` (or null). Other methods, paths, hosts
  // and origins are refused; a request may have 16 KiB of headers, and content only where that is said. Null: no port, `error`
  // says why.
  void* (*start)(const FlexelServedFile* files, std::size_t count, const FlexelServeLive* live,
                 const char* policy, std::uint16_t* port, int* error);
  void (*stop)(void* server);
};

// The name of the module's one function, and its type.
#define FLEXEL_SERVE_MODULE flexel_serve_module
using FlexelServeModuleFunction = const FlexelServeModule*();
FlexelServeModuleFunction FLEXEL_SERVE_MODULE;
}
