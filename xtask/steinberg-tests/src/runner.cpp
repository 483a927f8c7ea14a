// Runs the tests of Steinberg's VST3 SDK on every class of a plugin, and prints them.

#include <cstdio>
#include <functional>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "public.sdk/source/vst/hosting/hostclasses.h"
#include "public.sdk/source/vst/hosting/module.h"
#include "public.sdk/source/vst/hosting/plugprovider.h"
#include "public.sdk/source/vst/testsuite/vsttestsuite.h"
#include "public.sdk/source/vst/utility/stringconvert.h"

namespace {

using namespace Steinberg;
using namespace Steinberg::Vst;

// Keeps what a test says. Its errors count, its other messages are printed only for a test that fails.
class Messages : public ITestResult {
public:
    void PLUGIN_API addErrorMessage(const tchar* message) override {
        ++errors;
        keep("error: ", message);
    }
    void PLUGIN_API addMessage(const tchar* message) override { keep("", message); }

    // It lives on the stack, so nobody owns it.
    tresult PLUGIN_API queryInterface(const TUID, void** object) override {
        *object = nullptr;
        return kNoInterface;
    }
    uint32 PLUGIN_API addRef() override { return 1; }
    uint32 PLUGIN_API release() override { return 1; }

    int errors = 0;
    std::vector<std::string> lines;

private:
    void keep(const char* before, const tchar* message) {
        lines.push_back(before + StringConvert::convert(reinterpret_cast<const TChar*>(message)));
    }
};

struct Counts {
    int passed = 0;
    int failed = 0;
};

// Runs one test as the SDK asks: set up, run, tear down.
void run(TestBase& test, Counts& counts) {
    Messages messages;
    const std::string name = test.getName();
    const bool isSetUp = test.setup();
    const bool hasRun = isSetUp && test.run(&messages);
    const bool isTornDown = test.teardown();
    const bool passed = hasRun && isTornDown && messages.errors == 0;
    ++(passed ? counts.passed : counts.failed);
    std::printf("  %s ... %s\n", name.c_str(), passed ? "ok" : "FAILED");
    if (!passed) {
        const char* step = !isSetUp ? "cannot set up" : !hasRun ? "the run failed" : !isTornDown ? "cannot tear down" : "";
        std::printf("      %s\n", step);
        for (const auto& line : messages.lines) {
            std::printf("      %s\n", line.c_str());
        }
    }
    std::fflush(stdout);
}

// The tests that Steinberg's validator runs, and more of them: each automation and each pair of speaker arrangements. Like
// the validator it leaves out BusInvalidIndexTest, InvalidStateTransitionTest and RepeatIdenticalStateTransitionTest, which
// ask for what the format does not. A plugin without double precision passes the tests of it.
void runAll(ITestPlugProvider* plug, Counts& counts) {
    const ProcessSampleSize sizes[] = {kSample32, kSample64};
    const SpeakerArrangement speakers[] = {SpeakerArr::kMono, SpeakerArr::kStereo, SpeakerArr::k50, SpeakerArr::k51,
                                           SpeakerArr::k71Cine};
    const auto check = [&](auto* test) {
        // The SDK counts references from one.
        IPtr<TestBase> owner = owned(static_cast<TestBase*>(test));
        run(*owner, counts);
    };
    check(new EditorClassesTest(plug));
    check(new ScanBussesTest(plug));
    check(new ScanParametersTest(plug));
    check(new MidiMappingTest(plug));
    check(new MidiLearnTest(plug));
    check(new UnitInfoTest(plug));
    check(new ProgramInfoTest(plug));
    check(new UnitStructureTest(plug));
    check(new TerminateInitializeTest(plug));
    check(new ParameterFunctionNameTest(plug));
    check(new NoteExpressionTest(plug));
    check(new KeyswitchTest(plug));
    check(new BusConsistencyTest(plug));
    check(new BusActivationTest(plug));
    check(new CheckAudioBusArrangementTest(plug));
    check(new SideChainArrangementTest(plug));
    check(new ProcessContextRequirementsTest(plug));
    for (const auto size : sizes) {
        std::printf("  -- %s precision\n", size == kSample32 ? "single" : "double");
        check(new ValidStateTransitionTest(plug, size));
        check(new SuspendResumeTest(plug, size));
        check(new ProcessTest(plug, size));
        check(new ProcessThreadTest(plug, size));
        check(new ProcessFormatTest(plug, size));
        check(new ProcessTailTest(plug, size));
        check(new ProcessInputOverwritingTest(plug, size));
        check(new SilenceFlagsTest(plug, size));
        check(new SilenceProcessingTest(plug, size));
        check(new VariableBlockSizeTest(plug, size));
        check(new FlushParamTest(plug, size));
        check(new FlushParamTest2(plug, size));
        check(new FlushParamTest3(plug, size));
        check(new BypassPersistenceTest(plug, size));
        for (const bool eachSample : {false, true}) {
            for (const int32 every : {1, 64, 100}) {
                // The first parameter, then all of them.
                check(new AutomationTest(plug, size, every, 1, eachSample));
                check(new AutomationTest(plug, size, every, 0, eachSample));
            }
        }
        for (const auto in : speakers) {
            for (const auto out : speakers) {
                check(new SpeakerArrangementTest(plug, size, in, out));
            }
        }
    }
}

}  // namespace

extern "C" int run_steinberg_tests(const char* path) {
    std::string reason;
    const auto module = VST3::Hosting::Module::create(path, reason);
    if (!module) {
        std::fprintf(stderr, "steinberg-tests: cannot load %s: %s\n", path, reason.c_str());
        return 2;
    }
    HostApplication host;
    PluginContextFactory::instance().setPluginContext(&host);
    TestingPluginContext::set(&host);
    PlugProvider::setErrorStream(&std::cerr);
    const auto& factory = module->getFactory();
    factory.setHostContext(&host);
    Counts counts;
    int classes = 0;
    for (const auto& info : factory.classInfos()) {
        if (info.category() != kVstAudioEffectClass) {
            continue;
        }
        ++classes;
        std::printf("%s, version %s\n", info.name().c_str(), info.version().c_str());
        const auto plug = owned(new PlugProvider(factory, info, true));
        if (!plug->initialize()) {
            std::fprintf(stderr, "steinberg-tests: cannot make a %s\n", info.name().c_str());
            ++counts.failed;
            continue;
        }
        runAll(plug, counts);
    }
    PluginContextFactory::instance().setPluginContext(nullptr);
    TestingPluginContext::set(nullptr);
    if (classes == 0) {
        std::fprintf(stderr, "steinberg-tests: %s has no plugin\n", path);
        return 2;
    }
    std::printf("Steinberg's tests: %d passed, %d failed\n", counts.passed, counts.failed);
    return counts.failed == 0 ? 0 : 1;
}
