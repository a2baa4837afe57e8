// SPDX-License-Identifier: MIT
//
// A picture that is drawn while the window goes on. Internal.
module;
#include <thread>
module cilantro.window:background_picture;

import cilantro.standard;
import cilantro.visualization;

namespace cilantro {

/// One picture at a time, by a thread of its own.
class background_picture {
 public:
  /// `when_done` is called by that thread.
  explicit background_picture(std::function<void()> when_done) : when_done_{std::move(when_done)} {}

  void begin(const scene& all, const view& from, const render_options& options) {
    give_up();
    painter_ =
        std::jthread{[this, all, from, options = options](const std::stop_token& stop) mutable {
          options.monitor.stop = stop;
          std::optional<image<rgb>> picture;
          std::exception_ptr failure;
          try {
            picture = render(all, from, options);
          } catch (const cancelled&) {
            return;
          } catch (...) {
            failure = std::current_exception();
          }
          {
            const std::scoped_lock lock{mutex_};
            picture_ = std::move(picture);
            failure_ = failure;
          }
          when_done_();
        }};
  }
  void give_up() {
    painter_ = {};  // Asks it to stop, and waits until it has.
    picture_.reset();
    failure_ = nullptr;
  }

  [[nodiscard]] bool is_done() {
    const std::scoped_lock lock{mutex_};
    return failure_ != nullptr || picture_.has_value();
  }
  /// The picture, once it is done. Throws what drawing it threw.
  [[nodiscard]] std::optional<image<rgb>> take() {
    const std::scoped_lock lock{mutex_};
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    return std::exchange(picture_, std::nullopt);
  }

 private:
  std::function<void()> when_done_;
  std::mutex mutex_;
  std::optional<image<rgb>> picture_;  ///< Guarded by the mutex while a thread draws.
  std::exception_ptr failure_;         ///< As well.
  std::jthread painter_;               ///< The last, so that it ends before what it uses does.
};

}  // namespace cilantro
