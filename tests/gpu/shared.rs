//! Apps that one test after the other uses: starting an app and compiling its pipelines takes longer than most tests.

use std::{
    ops::{Deref, DerefMut},
    sync::{Mutex, PoisonError},
};

use bevy::{app::SubApps, prelude::*};
use bevy_gi::GiSettingsRegistry;

use crate::common::headless::Headless;

/// Apps of the same making that no test uses at the moment.
pub struct Pool {
    make: fn() -> Headless,
    /// Their worlds: tests run in threads of their own, and an `App` cannot leave its thread.
    idle: Mutex<Vec<SubApps>>,
}

impl Pool {
    pub const fn new(make: fn() -> Headless) -> Self {
        Self {
            make,
            idle: Mutex::new(Vec::new()),
        }
    }

    /// An app without entities of a scene, whose settings of this crate are the defaults.
    pub fn take(&'static self) -> SharedApp {
        let idle = self.idle().pop();
        let headless = match idle {
            Some(worlds) => {
                let mut headless = Headless::with_worlds(worlds);
                clear(headless.app.world_mut());
                // The render world and the assets follow in the next frame.
                headless.step();
                headless
            }
            None => (self.make)(),
        };
        SharedApp {
            headless,
            pool: self,
        }
    }

    fn idle(&self) -> std::sync::MutexGuard<'_, Vec<SubApps>> {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Removes a scene, and sets everything to its default that [`GiSettingsRegistry`] lists.
fn clear(world: &mut World) {
    let mut placed = world.query_filtered::<Entity, With<GlobalTransform>>();
    let placed: Vec<_> = placed.iter(world).collect();
    for entity in placed {
        // Its parent may have taken it along.
        world.try_despawn(entity).ok();
    }
    let registry = world.resource::<GiSettingsRegistry>().clone();
    for entry in registry.resources() {
        if let Some(mut value) = entry.get_mut(world) {
            value.apply(entry.default_value().as_partial_reflect());
        }
    }
}

/// An app of a [`Pool`], for one test at a time. It goes back when it is dropped, unless the test has failed.
pub struct SharedApp {
    headless: Headless,
    pool: &'static Pool,
}

impl Deref for SharedApp {
    type Target = Headless;

    fn deref(&self) -> &Headless {
        &self.headless
    }
}

impl DerefMut for SharedApp {
    fn deref_mut(&mut self) -> &mut Headless {
        &mut self.headless
    }
}

impl Drop for SharedApp {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            let worlds = std::mem::take(self.headless.app.sub_apps_mut());
            self.pool.idle().push(worlds);
        }
    }
}
