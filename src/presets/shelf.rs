//! What there is to choose from: the factory presets and the user's, in one list.

use super::user_folder::UserPresets;
use super::{Preset, factory};

/// All presets at one moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PresetShelf {
    /// The user's own, and what the user likes.
    pub user: UserPresets,
    /// What became of the last change, if it failed.
    pub notice: Option<String>,
}

impl PresetShelf {
    /// All of them: factory presets in the order of MIDI programs, then the user's by name.
    pub fn all(&self) -> impl DoubleEndedIterator<Item = &Preset> + Clone {
        factory::all().iter().chain(&self.user.presets)
    }

    /// The preset of exactly this name; the user's own first.
    pub fn find(&self, name: &str) -> Option<&Preset> {
        self.user.presets.iter().chain(factory::all()).find(|preset| preset.name == name)
    }

    /// Whether a preset of this name is the user's.
    pub fn is_users(&self, name: &str) -> bool {
        self.user.presets.iter().any(|preset| preset.name == name)
    }

    /// Whether the user likes the preset of this name.
    pub fn is_liked(&self, name: &str) -> bool {
        self.user.favourites.contains(name)
    }

    /// The next preset after the one called `name` (`by` 1), or the one before it (-1), that is wanted, round and round; the first of all
    /// where there is none of that name.
    pub fn beside(&self, name: &str, by: isize, is_wanted: impl Fn(&Preset) -> bool) -> Option<&Preset> {
        let all: Vec<&Preset> = self.all().collect();
        let at = all.iter().position(|preset| preset.name == name);
        let from = at.map_or(-by, |at| at as isize);
        let step = |n: usize| (from + by * n as isize).rem_euclid(all.len() as isize) as usize;
        (1..=all.len()).map(|n| all[step(n)]).find(|preset| is_wanted(preset))
    }

    /// All tags, in the order in which they first appear.
    pub fn tags(&self) -> Vec<&str> {
        let mut tags: Vec<&str> = Vec::new();
        for tag in self.all().flat_map(|preset| &preset.tags) {
            if !tags.iter().any(|known| known.eq_ignore_ascii_case(tag)) {
                tags.push(tag);
            }
        }
        tags
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_through_the_list_goes_round_and_ends_with_the_users() {
        let mine = Preset { name: "Mine".to_owned(), tags: vec!["new".to_owned()], ..Preset::default() };
        let user = UserPresets { presets: vec![mine], ..UserPresets::default() };
        let shelf = PresetShelf { user, ..PresetShelf::default() };
        let first = factory::all()[0].name.as_str();
        let name = |of: &str, by| shelf.beside(of, by, |_| true).unwrap().name.as_str();
        assert_eq!((name(first, -1), name("Mine", 1), name("gone", 1)), ("Mine", first, first));
        assert_eq!(name(first, 1), factory::all()[1].name);
        let jazz = |by| shelf.beside(first, by, |preset| preset.has_tag("jazz")).unwrap();
        assert!(jazz(1).has_tag("jazz") && shelf.beside(first, 1, |_| false).is_none());
        assert_ne!(jazz(1).name, jazz(-1).name, "the nearest on either side");
        assert!(shelf.is_users("Mine") && !shelf.is_users(first));
        assert_eq!(shelf.tags().last(), Some(&"new"));
    }
}
