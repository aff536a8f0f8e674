// Threads in one long row, which is folded where a dispatch has too many workgroups: `Dispatch::Row`, and indirect
// dispatches over lists.
#define_import_path bevy_gi::gpu::row

// Threads of a workgroup.
const LANES: u32 = #{LANES}u;
// Workgroups along x.
const ROW: u32 = #{ROW}u;

// The number of a workgroup.
fn row_group(group: vec3<u32>) -> u32 {
    return group.y * ROW + group.x;
}

// The number of a thread.
fn row_index(group: vec3<u32>, lane: u32) -> u32 {
    return row_group(group) * LANES + lane;
}

// Workgroups for a number of threads.
fn row_groups(threads: u32) -> u32 {
    return (threads + LANES - 1u) / LANES;
}

// Arguments of an indirect dispatch of a number of workgroups.
fn row_arguments(groups: u32) -> vec3<u32> {
    return vec3(min(groups, ROW), (groups + ROW - 1u) / ROW, 1u);
}
