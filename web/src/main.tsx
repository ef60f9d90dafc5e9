import { render } from 'preact'
import { App } from './app'
import { followLinks } from './router/navigation'
import { takeTokenOfLink } from './session/session'
import './styles/index.css'
import { startTheme } from './theme'

startTheme()
followLinks()
takeTokenOfLink().then(() => render(<App />, document.getElementById('page')!))
