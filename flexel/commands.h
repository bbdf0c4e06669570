// The commands of flexel. Each takes its own arguments (argv[0] is the command) and returns the exit code.
#pragma once

namespace flexel::commands {

int clay_command(int argc, char** argv);
int coarsen_command(int argc, char** argv);
int compare_command(int argc, char** argv);
int compensate_command(int argc, char** argv);
int deform_command(int argc, char** argv);
int doctor_command(int argc, char** argv);
int export_command(int argc, char** argv);
int flex_command(int argc, char** argv);
int info_command(int argc, char** argv);
int picture_command(int argc, char** argv);
int materials_command(int argc, char** argv);
int measure_command(int argc, char** argv);
int scene_keys_command(int argc, char** argv);
int study_command(int argc, char** argv);
int view_command(int argc, char** argv);

// Becomes the stage program flexel-NAME that lies beside this one. Returns only by throwing InputError: it is
// not there.
[[noreturn]] void run_stage_program(const char* name, char** argv);

}  // namespace flexel::commands
