/** Global keyboard shortcuts; the dialogs are loaded on first use. */

import type { ComponentType } from 'preact'
import { useEffect, useState } from 'preact/hooks'
import { navigate } from '../router/navigation'
import { toggleTheme } from '../theme'
import type { DialogsProps } from './dialogs'
import { type Action, actionOf, shortcutsOn } from './shortcuts'

export type Shown = 'palette' | 'help' | null

export function Keys() {
  const [shown, setShown] = useState<Shown>(null)
  const [Dialogs, setDialogs] = useState<ComponentType<DialogsProps> | null>(null)
  const act = (action: Action) => {
    if (action.kind === 'go') navigate(action.href)
    else if (action.kind === 'theme') toggleTheme()
    else show(action.kind)
  }
  const show = (kind: Shown) => {
    import('./dialogs').then(
      ({ default: loaded }) => {
        setDialogs(() => loaded)
        setShown(kind)
      },
      () => location.reload(),
    )
  }
  useEffect(() => {
    const press = (event: KeyboardEvent) => {
      if (event.defaultPrevented) return
      const action = actionOf(event, event.target as Element | null, shortcutsOn())
      if (!action) return
      event.preventDefault()
      act(action)
    }
    addEventListener('keydown', press)
    return () => removeEventListener('keydown', press)
  }, [])
  return (
    <>
      <button
        type="button"
        class="compact find"
        aria-keyshortcuts="Control+K Meta+K"
        onClick={() => show('palette')}
      >
        Find… <kbd>Ctrl K</kbd>
      </button>
      {Dialogs && shown && <Dialogs shown={shown} onShow={setShown} />}
    </>
  )
}
