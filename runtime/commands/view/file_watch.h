#pragma once

#include <atomic>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace packtrace {

/// Calls a function in a separate thread when files change on disk: when their size or modification time has changed
/// and is then equal in two consecutive checks.
class FileWatch {
public:
  /// @param changed gets the file's number; runs in the watching thread
  explicit FileWatch(std::function<void(size_t file)> changed);
  ~FileWatch();
  FileWatch(const FileWatch&) = delete;
  FileWatch& operator=(const FileWatch&) = delete;

  /// Adds a file; its number is that of the files added before.
  void add(const std::string& file);
  /// Runs work in the watching thread.
  void run(std::function<void()> work);

private:
  struct Version {
    bool exists = false;
    uintmax_t bytes = 0;
    std::filesystem::file_time_type time;
    bool operator==(const Version&) const = default;
  };
  struct Watched {
    std::string file;
    Version known, seen; ///< at the last call, and at the last check
  };
  static Version version_of(const std::string& file);
  void loop();

  std::function<void(size_t)> changed_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<Watched> files_;
  std::vector<std::function<void()>> work_;
  bool quit_ = false;
  std::thread thread_; ///< last: it uses the others
};

} // namespace packtrace
