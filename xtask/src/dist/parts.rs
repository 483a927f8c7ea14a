//! The parts list of the binaries (a software bill of materials), in the format CycloneDX: every crate inside, with its
//! licence and the checksum of its source.

use std::collections::BTreeMap;
use std::fs;

use anyhow::{Context, Result, anyhow, ensure};
use cyclonedx_bom::models::component::Classification;
use cyclonedx_bom::models::hash::{Hash, HashAlgorithm, HashValue, Hashes};
use cyclonedx_bom::models::license::{LicenseChoice, Licenses};
use cyclonedx_bom::prelude::{
    Bom, Component, Components, DateTime, Metadata, NormalizedString, Purl, Validate,
};
use time::format_description::well_known::Rfc3339;

use super::{Release, System};
use crate::{licences, machine};

/// The list for a system, as JSON.
pub fn list(system: System, release: &Release) -> Result<Vec<u8>> {
    let sums = sums(&fs::read_to_string(machine::root().join("Cargo.lock"))?)?;
    let crates = licences::inside(system.target)?;
    let component = |title: &str, licence: &str| -> Result<Component> {
        let (name, version) = title.split_once(' ').context("a crate without a version")?;
        let purl = Purl::new("cargo", name, version)?;
        let mut component = Component::new(Classification::Library, name, version, Some(purl.to_string()));
        component.licenses = Some(Licenses(vec![LicenseChoice::expression(&licence.replace('/', " OR "))]));
        component.hashes = sums
            .get(title)
            .map(|sum| Hashes(vec![Hash { alg: HashAlgorithm::SHA_256, content: HashValue(sum.clone()) }]));
        component.purl = Some(purl);
        Ok(component)
    };
    let parts = crates.iter().map(|(title, licence)| component(title, licence)).collect::<Result<_>>()?;
    let mut whole = Component::new(
        Classification::Application,
        "chalumeau",
        &release.version,
        Some(format!("chalumeau-{}-{}", release.version, system.name)),
    );
    whole.licenses = Some(Licenses(vec![LicenseChoice::expression("MIT OR Apache-2.0")]));
    whole.description = Some(NormalizedString::new(&format!("built for {}", system.target)));
    let time = DateTime::try_from(release.time()?.format(&Rfc3339)?).map_err(|error| anyhow!("{error}"))?;
    let bom = Bom {
        // By default it has a number by chance; this list is the same whenever it is made.
        serial_number: None,
        metadata: Some(Metadata { timestamp: Some(time), component: Some(whole), ..Metadata::default() }),
        components: Some(Components(parts)),
        ..Bom::default()
    };
    let valid = bom.validate();
    ensure!(valid.passed(), "the parts list does not follow CycloneDX: {valid:?}");
    let mut json = Vec::new();
    bom.output_as_json_v1_5(&mut json).map_err(|error| anyhow!("{error:?}"))?;
    Ok(json)
}

/// The checksums of the crates in Cargo.lock, by name and version.
fn sums(lock: &str) -> Result<BTreeMap<String, String>> {
    let table: toml::Table = lock.parse().context("Cargo.lock")?;
    let packages =
        table.get("package").and_then(toml::Value::as_array).context("Cargo.lock has no packages")?;
    let sum = |package: &toml::Value| {
        let word = |key: &str| package.get(key)?.as_str();
        Some((format!("{} {}", word("name")?, word("version")?), word("checksum")?.to_owned()))
    };
    Ok(packages.iter().filter_map(sum).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crate_of_the_registry_has_a_sum_and_ours_has_none() {
        let lock = "[[package]]\nname = \"reed\"\nversion = \"1.0.0\"\nchecksum = \"ab\"\n\n\
                    [[package]]\nname = \"chalumeau\"\nversion = \"0.1.0\"\n";
        assert_eq!(sums(lock).unwrap(), BTreeMap::from([("reed 1.0.0".to_owned(), "ab".to_owned())]));
    }
}
