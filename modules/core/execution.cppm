// SPDX-License-Identifier: MIT
export module cilantro.core:execution;

import cilantro.standard;

namespace cilantro {

/// Watches a long call and can stop it. Costs nothing while both members are empty.
export struct task_monitor {
  /// Called now and then with the share that is done, increasing to 1, on the calling thread only.
  std::function<void(double)> progress = {};
  /// Once a stop is requested, the call throws `cancelled` and leaves its inputs as they were.
  std::stop_token stop = {};
};

/// A monitor for work in `count` passes, each of which reports from 0 to 1: what they report rises
/// over all of them, to 1 after the last. For one thread.
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
  task_monitor monitor = {};
};

}  // namespace cilantro
