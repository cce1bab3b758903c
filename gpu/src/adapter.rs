//! Which adapter is used, and what it is called. One that is emulated on the processor says so.

use crate::context::ContextError;

/// The environment variable that names the adapter to use: any part of its name, case ignored.
pub const ADAPTER_VARIABLE: &str = "TERRAIN_ADAPTER";

/// An adapter in words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Description {
    /// Its name, with "software" where it is emulated on the processor.
    pub name: String,
    /// Driver and its version.
    pub driver: String,
    /// Vulkan, Metal or DirectX 12.
    pub backend: String,
    /// Whether it is emulated on the processor.
    pub software: bool,
}

impl Description {
    pub(crate) fn new(info: &wgpu::AdapterInfo) -> Description {
        let software = info.device_type == wgpu::DeviceType::Cpu;
        let name = if software { format!("{} (software)", info.name) } else { info.name.clone() };
        let backend = match info.backend {
            wgpu::Backend::Vulkan => "Vulkan",
            wgpu::Backend::Metal => "Metal",
            wgpu::Backend::Dx12 => "DirectX 12",
            _ => "another",
        };
        let driver = format!("{} {}", info.driver, info.driver_info);
        Description { name, driver: driver.trim().to_owned(), backend: backend.to_owned(), software }
    }
}

/// Whether to go on without an adapter is a failure: where `TERRAIN_REQUIRE_GPU` is 1.
pub fn required() -> bool {
    std::env::var("TERRAIN_REQUIRE_GPU").is_ok_and(|value| value == "1")
}

/// The adapter a run on this machine would use, or `None` when it has none.
pub fn describe() -> Option<Description> {
    choose(None).ok().map(|adapter| Description::new(&adapter.get_info()))
}

/// The adapter that `wanted` or the environment names; without a name, the fastest kind there is, hardware before
/// software.
///
/// # Errors
/// When there is none, or none of that name.
pub fn choose(wanted: Option<&str>) -> Result<wgpu::Adapter, ContextError> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
    let from_environment = std::env::var(ADAPTER_VARIABLE).ok().filter(|name| !name.is_empty());
    let wanted = wanted.map(str::to_owned).or(from_environment);
    let names: Vec<(String, wgpu::DeviceType)> =
        adapters.iter().map(wgpu::Adapter::get_info).map(|info| (info.name, info.device_type)).collect();
    let chosen = pick(&names, wanted.as_deref())?;
    adapters.into_iter().nth(chosen).ok_or(ContextError::NoAdapter)
}

/// Which of the adapters: the first of the best kind whose name contains `wanted`.
fn pick(adapters: &[(String, wgpu::DeviceType)], wanted: Option<&str>) -> Result<usize, ContextError> {
    use wgpu::DeviceType::{Cpu, DiscreteGpu, IntegratedGpu, Other, VirtualGpu};
    if adapters.is_empty() {
        return Err(ContextError::NoAdapter);
    }
    let rank = |kind: wgpu::DeviceType| match kind {
        DiscreteGpu => 0,
        IntegratedGpu => 1,
        VirtualGpu => 2,
        Other => 3,
        Cpu => 4,
    };
    let named = |name: &str| wanted.is_none_or(|wanted| name.to_lowercase().contains(&wanted.to_lowercase()));
    let fitting = adapters.iter().enumerate().filter(|(_, (name, _))| named(name));
    fitting.min_by_key(|(_, (_, kind))| rank(*kind)).map(|(index, _)| index).ok_or_else(|| {
        let found = adapters.iter().map(|(name, _)| name.clone()).collect();
        ContextError::NoSuchAdapter { wanted: wanted.unwrap_or_default().to_owned(), found }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use wgpu::DeviceType::{Cpu, DiscreteGpu, IntegratedGpu};

    #[test]
    fn hardware_comes_before_software_and_a_name_before_both() {
        let adapters = [("llvmpipe".to_owned(), Cpu), ("Iris".into(), IntegratedGpu), ("Arc 770".into(), DiscreteGpu)];
        assert_eq!(pick(&adapters, None).unwrap(), 2);
        assert_eq!(pick(&adapters[..2], None).unwrap(), 1);
        assert_eq!(pick(&adapters, Some("LLVM")).unwrap(), 0);
    }

    #[test]
    fn a_missing_adapter_is_one_line_that_says_what_to_do() {
        let none = pick(&[], Some("x")).unwrap_err().to_string();
        assert!(none.contains("install a driver") && none.contains("mesa-vulkan-drivers"), "{none}");
        let other = pick(&[("llvmpipe".to_owned(), Cpu)], Some("geforce")).unwrap_err().to_string();
        assert!(other.contains("`geforce`") && other.contains("llvmpipe"), "{other}");
        assert!(!none.contains('\n') && !other.contains('\n'));
    }
}
