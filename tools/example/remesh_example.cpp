// SPDX-License-Identifier: MIT
//
// One scan through Rattan's library: options, progress, a time limit, the result and every error.
//
//   remesh_example SCAN OUT FACES [SECONDS]

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <mutex>
#include <rattan/remesh.h>
#include <set>
#include <string>

namespace {

/// Prints the name of each stage, and asks to stop when the time is up.
class Watch final : public rattan::ProgressSink {
 public:
  explicit Watch(double seconds) : seconds_(seconds) {}

  rattan::StopRequests stop_requests() const { return {.soon = stop_.get_token(), .now = {}}; }

  // Called from several threads at once.
  void progress(std::string_view stage, std::uint64_t /*done*/, std::uint64_t /*total*/) override {
    const std::scoped_lock lock(mutex_);
    if (seen_.insert(std::string(stage)).second) {
      std::printf("%.*s\n", static_cast<int>(stage.size()), stage.data());
    }
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start_;
    if (spent.count() > seconds_) {
      stop_.request_stop();
    }
  }

  void warning(const std::string& sentence) override {
    std::fprintf(stderr, "warning: %s\n", sentence.c_str());
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  double seconds_;
  std::stop_source stop_;
  std::mutex mutex_;
  std::set<std::string> seen_;
};

int fail(const char* what, const std::exception& error) {
  std::fprintf(stderr, "%s: %s\n", what, error.what());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: remesh_example SCAN OUT FACES [SECONDS]\n");
    return 2;
  }
  rattan::RemeshOptions options;
  options.scan = argv[1];
  options.output = argv[2];
  options.size_kind = rattan::SizeKind::kFaces;
  options.sizes = {std::strtod(argv[3], nullptr)};

  Watch watch(argc > 4 ? std::strtod(argv[4], nullptr) : 3600.0);
  try {
    const rattan::RemeshResult result = rattan::remesh(options, watch, watch.stop_requests());
    const rattan::WrittenRemesh& remesh = result.outputs.front();
    std::printf("%s: %llu faces, %llu of them quads, in %.1f s\n", remesh.path.c_str(),
                static_cast<unsigned long long>(remesh.faces),
                static_cast<unsigned long long>(remesh.quads), result.seconds);
    return 0;
  } catch (const rattan::Cancelled& error) {  // the same call goes on later
    fail("out of time", error);
    return 75;
  } catch (const rattan::UsageError& error) {
    return fail("an option is wrong", error);
  } catch (const rattan::InputError& error) {
    return fail("the scan cannot be used", error);
  } catch (const rattan::ResourceError& error) {
    return fail("memory or disk ran out", error);
  } catch (const std::exception& error) {  // rattan::InternalError, std::bad_alloc
    return fail("a defect", error);
  }
}
