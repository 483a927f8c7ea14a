// Plays one held note through an instrument of STK and prints what a sample costs. Sound goes nowhere.
//
//   stk blowhole|clarinet SECONDS [RATE]
//
// The note is sounding B flat 3, the written C4 of benches/programs/src/bin/instructions.rs. The clock is the thread's own CPU time
// and starts after the instrument is built; under callgrind the difference of two run lengths does the same.

#include <stk/BlowHole.h>
#include <stk/Clarinet.h>
#include <stk/Stk.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>

namespace {

constexpr double note_hz = 233.0818807590450;
constexpr double lowest_hz = 100.0;  // longest tube either instrument has to hold
constexpr double amplitude = 0.8;

double thread_seconds() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

template <typename Instrument>
int play(const char* name, double seconds, double rate) {
    stk::Stk::setSampleRate(rate);
    Instrument instrument(lowest_hz);
    instrument.noteOn(note_hz, amplitude);
    const auto samples = static_cast<long>(seconds * rate);
    double sum = 0.0, power = 0.0;  // printed, so that no sample can be optimised away and silence would be seen
    const double start = thread_seconds();
    for (long sample = 0; sample < samples; ++sample) {
        const double pressure = instrument.tick();
        sum += pressure;
        power += pressure * pressure;
    }
    const double spent = thread_seconds() - start;
    const double mean = sum / samples;
    std::printf("%s samples %ld rms %.6e ns_per_sample %.2f\n", name, samples,
                std::sqrt(power / samples - mean * mean), 1e9 * spent / samples);
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    const double seconds = argc > 2 ? std::atof(argv[2]) : 0.0;
    const double rate = argc > 3 ? std::atof(argv[3]) : 48000.0;
    if (seconds > 0.0 && rate >= 8000.0) {
        if (std::strcmp(argv[1], "blowhole") == 0) return play<stk::BlowHole>("blowhole", seconds, rate);
        if (std::strcmp(argv[1], "clarinet") == 0) return play<stk::Clarinet>("clarinet", seconds, rate);
    }
    std::fprintf(stderr, "usage: stk blowhole|clarinet SECONDS [RATE >= 8000]\n");
    return 2;
}
