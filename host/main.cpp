// The program `brume`. Exit status: 0 done, 1 a check failed, 2 wrong use, 3 an input could not be read or an
// output not written.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <exception>
#include <filesystem>
#include <iostream>
#include <new>

#include "commands.hpp"
#include "error.hpp"
#include "gl/pass_watch.hpp"
#include "nearest_name.hpp"
#include "printable.hpp"

using namespace brume;

namespace {

int fail(const std::string& sentence, ErrorKind kind) {
    // A file may quote itself at any length.
    std::cerr << "brume: " << host::printable(host::shortened(sentence, 4000)) << "\n";
    return int(kind);
}

// CLI11 says which words it did not expect, not which option was meant.
std::string sentenceFor(const CLI::ParseError& error, const CLI::App& program) {
    const std::vector<const CLI::App*> used = program.get_subcommands([](auto*) { return true; });
    std::string help = "brume --help", wrong = error.what();
    for (const CLI::App* command : used) {
        if (!command->parsed()) continue;
        help = "brume " + command->get_name() + " --help";
        std::vector<std::string> names;
        for (const CLI::Option* option : command->get_options())
            for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
        for (const std::string& word : command->remaining()) {
            const std::string name = word.substr(0, word.find('='));
            if (name.size() < 2 || name[0] != '-') continue;
            const std::string near = nearestName(name, names);
            wrong = text("no option '", name, "'", near.empty() ? "" : text(" (did you mean '", near, "'?)"));
            break;
        }
    }
    return text(wrong, "; see '", help, "'");
}

int run(int argc, char** argv) {
    CLI::App program(
        "Fog and other image-space effects on captured frames: a colour image and a depth image of one view.",
        "brume");
    program.set_version_flag("--version", "brume " BRUME_VERSION);
    program.require_subcommand(1);
    host::addApply(program);
    host::addPreview(program);
    host::addCheck(program);
    host::addBench(program);
    host::addChart(program);
    host::addList(program);
    host::addInfo(program);
    host::addInspect(program);
    host::addConvert(program);
    host::addConvertPreset(program);
    host::addNew(program);
    program.footer(
        "Examples:\n"
        "  brume apply depth_fog frame.png -o fogged.png\n"
        "  brume list\n"
        "  brume apply --help\n"
        "\nExit status: 0 done, 1 a check failed, 2 wrong use, 3 a file could not be read or written.");
    // CLI11 only says that it did not expect the word.
    std::vector<std::string> names;
    for (const CLI::App* command : program.get_subcommands({})) names.push_back(command->get_name());
    if (argc > 1 && argv[1][0] != '-' && std::find(names.begin(), names.end(), argv[1]) == names.end())
        return fail(text("no command '", argv[1], "'", suggestion(argv[1], names)), ErrorKind::Usage);
    try {
        program.parse(argc, argv);
    } catch (const CLI::Success& e) {  // --help, --version
        return program.exit(e);
    } catch (const CLI::ParseError& e) {
        return fail(sentenceFor(e, program), ErrorKind::Usage);
    }
    return 0;
}

// A file must not take the place of a standard stream that is closed, and get what is printed.
void openStandardStreams() {
    int file = 0;
    while ((file = open("/dev/null", O_RDWR)) >= 0 && file <= STDERR_FILENO) {
    }
    if (file >= 0) close(file);
}

}  // namespace

int main(int argc, char** argv) {
    openStandardStreams();
    std::signal(SIGXFSZ, SIG_IGN);  // a file over the shell's limit is an error like a full disk
    const host::PrintableOutput output;
    int status = 0;
    try {
        status = run(argc, argv);
    } catch (const Error& e) {
        status = fail(e.what(), e.kind());
    } catch (const std::filesystem::filesystem_error& e) {
        status = fail(text("'", e.path1().string(), "': ", e.code().message()), ErrorKind::Io);
    } catch (const std::bad_alloc&) {
        status = fail("not enough memory", ErrorKind::Io);
    } catch (const std::exception& e) {
        status = fail(text("unexpected: ", e.what()), ErrorKind::CheckFailed);
    }
    output.flush();
    if (!std::cout && status == 0) status = fail("standard output: cannot be written", ErrorKind::Io);
    if (isAnyPassRunningOn()) {  // a shader that nothing can stop, and nothing may be taken from
        _exit(status);
    }
    return status;
}
