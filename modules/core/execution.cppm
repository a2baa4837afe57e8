// SPDX-License-Identifier: MIT
export module cilantro.core:execution;

import cilantro.standard;

namespace cilantro {

/// Watches a long call and can stop it. Costs nothing if both members are empty.
export struct task_monitor {
  /// Called from time to time with the share of the work that is done, increasing to 1, and only on
  /// the calling thread.
  std::function<void(double)> progress = {};
  /// Once a stop is requested, the call throws `cancelled` and leaves its inputs unchanged.
  std::stop_token stop = {};
};

/// A monitor for work in `count` passes that each report progress from 0 to 1: together they report
/// one progress from 0 to 1. For use on one thread.
export [[nodiscard]] inline task_monitor in_passes(const task_monitor& monitor, int count) {
  if (!monitor.progress) return monitor;
  struct state {
    int done = 0;
    double share = 0;
  };
  return {[progress = monitor.progress, count, now = std::make_shared<state>()](double share) {
            now->share = std::max(now->share, (std::min(now->done, count - 1) + share) / count);
            now->done += share >= 1;
            progress(now->share);
          },
          monitor.stop};
}

/// How a call may use the machine. Results never depend on it.
export struct execution {
  int threads = 0;  ///< 0: OpenMP's own choice (OMP_NUM_THREADS); 1: the calling thread only.
  task_monitor monitor = {};  ///< Watches the call.
};

}  // namespace cilantro
