// A temporary folder for the files of child processes.
#pragma once
#include <filesystem>

namespace flexel {

// A folder of its own under `parent`, removed with all that is in it.
class TemporaryFolder {
 public:
  // Throws InputError: `parent` cannot be written to.
  explicit TemporaryFolder(const std::filesystem::path& parent = std::filesystem::temp_directory_path());
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace flexel
